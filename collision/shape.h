// A convex shape at a pose in the world, and the distance of two shapes. Lengths are in m.
#pragma once

#include <Eigen/Core>

namespace evalbus::collision {

// The axis of capsules and cylinders is the local z axis.
struct Shape {
  enum class Kind { kPlane, kSphere, kCapsule, kEllipsoid, kCylinder, kBox, kMesh };

  Kind kind = Kind::kSphere;
  // Sphere: radius. Capsule and cylinder: radius, half length (of the segment). Ellipsoid: semi-axes. Box:
  // half extents.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  // Corners of a mesh's convex hull, one per row, in the local frame.
  Eigen::MatrixX3d corners;
  // Pose in the world.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
};

// Distance of a pair of shapes, and its nearest or deepest point.
struct Proximity {
  // Signed distance. In penetration, it is negative; its magnitude is the distance by which the shapes must
  // be moved along the normal until they only touch.
  double distance = 0;
  // Point midway between the two surfaces, along the normal.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  // Unit vector from the first shape to the second.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

// Directions this close to perpendicular count as perpendicular when a point is chosen. The effect on a
// distance is of the order of this fraction of the shape's size.
inline constexpr double kFlat = 1e-9;

// Returns the sign of the direction: -1, 0 or 1.
inline double Side(double direction) { return direction > kFlat ? 1 : direction < -kFlat ? -1 : 0; }

inline bool IsRound(const Shape& shape) {
  return shape.kind == Shape::Kind::kSphere || shape.kind == Shape::Kind::kCapsule;
}

// Returns the largest distance of a point of the shape from its origin; infinite for a plane.
double Radius(const Shape& shape);

// Returns the farthest point of the shape (not a plane) in direction `u`, a unit vector. If a whole face or
// edge is equally far, returns its center. Point and direction are in the local frame.
Eigen::Vector3d FarthestPoint(const Shape& shape, const Eigen::Vector3d& u);

}  // namespace evalbus::collision
