// Signed distance, contact point and normal of shape pairs that have an exact closed form: a plane against
// everything, spheres and capsules against each other, and spheres and capsules against boxes. FCL covers the
// other pairs. All poses are in the world frame, lengths in metres.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace evalbus {

// One shape in the world. The axis of capsules and cylinders is the local z axis.
struct Shape {
  enum class Kind { kPlane, kSphere, kCapsule, kEllipsoid, kCylinder, kBox, kMesh };

  Kind kind = Kind::kSphere;
  // Sphere: radius. Capsule and cylinder: radius, half length (of the segment). Ellipsoid: semi-axes. Box:
  // half extents.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  // Corners of a mesh's convex hull, local frame.
  std::vector<Eigen::Vector3d> corners;
  // Pose in the world.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
};

// Nearest or deepest place of a pair.
struct Proximity {
  // Negative in penetration: how far the shapes must move along the normal to touch.
  double distance = 0;
  // Midway between the two surfaces, along the normal.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  // Unit vector from the first shape to the second.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

// The plane fills everything below its local z = 0. Where a whole face or edge is equally deep, its centre is
// taken.
Proximity PlaneToShape(const Shape& plane, const Shape& other);

// A sphere is a capsule of length zero. Parallel capsules meet in the middle of their overlap.
Proximity CapsuleToCapsule(const Shape& a, const Shape& b);

// Exact also where the capsule's axis runs through the box.
Proximity CapsuleToBox(const Shape& capsule, const Shape& box);

}  // namespace evalbus
