#include "collision/shape.h"

#include <cmath>
#include <limits>

namespace evalbus::collision {

using Eigen::Vector3d;

namespace {

// Rounding error of mesh corners, m; they have single precision in the compiled model.
constexpr double kCornerNoise = 1e-7;

}  // namespace

double Radius(const Shape& shape) {
  const Vector3d& s = shape.size;
  switch (shape.kind) {
    case Shape::Kind::kSphere:
      return s[0];
    case Shape::Kind::kCapsule:
      return s[0] + s[1];
    case Shape::Kind::kEllipsoid:
      return s.maxCoeff();
    case Shape::Kind::kCylinder:
      return std::hypot(s[0], s[1]);
    case Shape::Kind::kBox:
      return s.norm();
    case Shape::Kind::kMesh:
      return shape.corners.rowwise().norm().maxCoeff();
    case Shape::Kind::kPlane:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

Vector3d FarthestPoint(const Shape& shape, const Vector3d& u) {
  const Vector3d& s = shape.size;
  switch (shape.kind) {
    case Shape::Kind::kSphere:
      return s[0] * u;
    case Shape::Kind::kCapsule:
      return s[0] * u + Vector3d(0, 0, Side(u[2]) * s[1]);
    case Shape::Kind::kEllipsoid: {
      const Vector3d scaled = s.cwiseProduct(u);
      return s.cwiseProduct(scaled) / scaled.norm();
    }
    case Shape::Kind::kCylinder: {
      const double radial = std::hypot(u[0], u[1]);
      const double scale = radial > kFlat ? s[0] / radial : 0;
      return {scale * u[0], scale * u[1], Side(u[2]) * s[1]};
    }
    case Shape::Kind::kBox:
      return {Side(u[0]) * s[0], Side(u[1]) * s[1], Side(u[2]) * s[2]};
    case Shape::Kind::kMesh: {
      // This is thread_local so that calls reuse its memory.
      thread_local Eigen::ArrayXd along;
      const auto corners = shape.corners.array();
      along = corners.col(0) * u[0] + corners.col(1) * u[1] + corners.col(2) * u[2];
      const double farthest = along.maxCoeff();
      Vector3d sum = Vector3d::Zero();
      int count = 0;
      for (Eigen::Index i = 0; i < along.size(); ++i) {
        if (along[i] < farthest - kCornerNoise) continue;
        sum += shape.corners.row(i).transpose();
        ++count;
      }
      // Use the center of all corners that are equally far within the rounding error, moved to the exact
      // distance of the farthest corner.
      const Vector3d center = sum / count;
      return center + (farthest - center.dot(u)) * u;
    }
    case Shape::Kind::kPlane:
      break;
  }
  return Vector3d::Zero();
}

}  // namespace evalbus::collision
