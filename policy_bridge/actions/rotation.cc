#include "policy_bridge/actions/rotation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace evalbus::policy {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// Vectors shorter than this have no meaningful direction.
constexpr double kShortest = 1e-6;
// If the cosine of the second Euler angle is below this value, the other two angles rotate about nearly the
// same axis.
constexpr double kGimbalLock = 1e-12;

[[noreturn]] void Fail(std::span<const double> values, const char* what) {
  std::string list;
  for (double value : values) list += fmt::format("{}{:.6g}", list.empty() ? "" : ", ", value);
  throw std::runtime_error(fmt::format("({}) is not a rotation: {}", list, what));
}

Quaterniond Normalized(double w, double x, double y, double z, std::span<const double> values) {
  Eigen::Vector4d v(x, y, z, w);
  if (v.stableNorm() < kShortest) Fail(values, "the norm of the quaternion is below 1e-6");
  v.stableNormalize();
  return Quaterniond(v);
}

Quaterniond FromRotationVector(const Vector3d& v) {
  const double angle = v.stableNorm();
  if (angle == 0) return Quaterniond::Identity();
  return Quaterniond(Eigen::AngleAxisd(angle, v / angle));
}

Quaterniond About(double angle, const Vector3d& axis) { return Quaterniond(Eigen::AngleAxisd(angle, axis)); }

// Returns the rotation (as a quaternion) whose matrix has these vectors as its first two columns, after
// orthonormalization.
Quaterniond FromColumns(Vector3d first, Vector3d second, std::span<const double> values) {
  if (first.stableNorm() < kShortest || second.stableNorm() < kShortest)
    Fail(values, "one of its two vectors is shorter than 1e-6");
  first.stableNormalize();
  second.stableNormalize();
  second -= first.dot(second) * first;
  if (second.norm() < kShortest) Fail(values, "its two vectors are parallel");
  second.normalize();
  Matrix3d matrix;
  matrix << first, second, first.cross(second);
  return Quaterniond(matrix);
}

// Returns the angles about the fixed x, y and z axes (R = Rz Ry Rx).
Vector3d ExtrinsicXyz(const Matrix3d& r) {
  const double cos_y = std::hypot(r(0, 0), r(1, 0));
  const double y = std::atan2(-r(2, 0), cos_y);
  const double z = cos_y < kGimbalLock ? 0 : std::atan2(r(1, 0), r(0, 0));
  // Rz^-1 R = Ry Rx, whose second row is (0, cos x, -sin x). This is exact even near gimbal lock, where z is
  // ill-defined but x + z or x - z is not.
  const double s = std::sin(z), c = std::cos(z);
  const double x = std::atan2(s * r(0, 2) - c * r(1, 2), c * r(1, 1) - s * r(0, 1));
  return {x, y, z};
}

Vector3d ShortestRotationVector(const Quaterniond& q) {
  const double sine = q.vec().norm();
  if (sine == 0) return Vector3d::Zero();
  const double angle = 2 * std::atan2(sine, std::abs(q.w()));
  return q.vec() * ((q.w() < 0 ? -angle : angle) / sine);
}

// Computes robosuite's quat2axisangle (utils/transform_utils.py): (x, y, z) 2 acos(w) / sqrt(1 - w^2), with w
// clipped to +-1. For a unit quaternion, the root equals the length of (x, y, z). The length is used, because
// the root loses all digits near 2 pi.
Vector3d RobosuiteRotationVector(const Quaterniond& q) {
  if (1 - q.w() * q.w() <= 0) return Vector3d::Zero();
  const double sine = q.vec().norm();
  return q.vec() * (2 * std::atan2(sine, q.w()) / sine);
}

}  // namespace

Quaterniond ReadRotation(RotationForm form, std::span<const double> values) {
  const auto& v = values;
  if (static_cast<int>(v.size()) != NumValues(form)) {
    Fail(v, fmt::format("expected {} values", NumValues(form)).c_str());
  }
  if (!std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); })) {
    Fail(v, "a value is not finite");
  }
  switch (form) {
    case RotationForm::kNone:
      break;
    case RotationForm::kQuaternionWxyz:
      return Normalized(v[0], v[1], v[2], v[3], v);
    case RotationForm::kQuaternionXyzw:
      return Normalized(v[3], v[0], v[1], v[2], v);
    case RotationForm::kAxisAngle:
    case RotationForm::kAxisAngleRobosuite:
      return FromRotationVector({v[0], v[1], v[2]});
    case RotationForm::kEulerXyzExtrinsic:
      return About(v[2], Vector3d::UnitZ()) * About(v[1], Vector3d::UnitY()) * About(v[0], Vector3d::UnitX());
    case RotationForm::kEulerXyzIntrinsic:
      return About(v[0], Vector3d::UnitX()) * About(v[1], Vector3d::UnitY()) * About(v[2], Vector3d::UnitZ());
    case RotationForm::kRotation6d:
      return FromColumns({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, v);
    case RotationForm::kRotation6dInterleaved:
      return FromColumns({v[0], v[2], v[4]}, {v[1], v[3], v[5]}, v);
    case RotationForm::kRotation6dRows:
      // The rows of a matrix are the columns of its inverse.
      return FromColumns({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, v).conjugate();
  }
  return Quaterniond::Identity();
}

void WriteRotation(RotationForm form, const Quaterniond& rotation, std::span<double> values) {
  const Quaterniond& q = rotation;
  const Matrix3d m = q.toRotationMatrix();
  const auto put = [values](const auto&... parts) {
    size_t next = 0;
    const auto one = [&](const auto& part) {
      for (Eigen::Index i = 0; i < part.size(); ++i) values[next++] = part[i];
    };
    (one(parts), ...);
  };
  switch (form) {
    case RotationForm::kNone:
      return;
    case RotationForm::kQuaternionWxyz:
      return put(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
    case RotationForm::kQuaternionXyzw:
      return put(q.coeffs());
    case RotationForm::kAxisAngle:
      return put(ShortestRotationVector(q));
    case RotationForm::kAxisAngleRobosuite:
      return put(RobosuiteRotationVector(q));
    case RotationForm::kEulerXyzExtrinsic:
      return put(ExtrinsicXyz(m));
    case RotationForm::kEulerXyzIntrinsic:
      // (Rx Ry Rz)^-1 rotates by the opposite angles about the fixed axes.
      return put(Vector3d(-ExtrinsicXyz(m.transpose())));
    case RotationForm::kRotation6d:
      return put(m.col(0), m.col(1));
    case RotationForm::kRotation6dInterleaved:
      return put(m.row(0).head<2>(), m.row(1).head<2>(), m.row(2).head<2>());
    case RotationForm::kRotation6dRows:
      return put(m.row(0), m.row(1));
  }
}

}  // namespace evalbus::policy
