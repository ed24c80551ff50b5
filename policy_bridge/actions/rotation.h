// Conversion of rotations from and to the forms that policies use.
#pragma once

#include <Eigen/Geometry>
#include <span>

#include "policy_bridge/actions/action_space.h"

namespace evalbus::policy {

// Reads NumValues(form) values as a unit quaternion; the identity for kNone. Quaternions are normalized, and
// 6D forms are orthonormalized by Gram-Schmidt (Zhou et al., "On the Continuity of Rotation Representations
// in Neural Networks", CVPR 2019). Throws std::runtime_error (one line) if the values are not a rotation: a
// value is not finite, a quaternion or a 6D column has zero length, or two columns are parallel.
Eigen::Quaterniond ReadRotation(RotationForm form, std::span<const double> values);

// Inverse of ReadRotation(): writes NumValues(form) values. `rotation` is a unit quaternion. The quaternion
// forms keep its sign. kAxisAngleRobosuite depends on the sign: a negative w yields an angle from pi to 2 pi,
// and w = +-1 yields the zero vector. kAxisAngle is the shortest rotation, up to pi. Of Euler angles, the
// second is within +-pi/2; where it is +-pi/2, the third is 0.
void WriteRotation(RotationForm form, const Eigen::Quaterniond& rotation, std::span<double> values);

}  // namespace evalbus::policy
