// Rotations in the forms in which policies say them and are shown them.
#pragma once

#include <Eigen/Geometry>
#include <span>

#include "policy_bridge/actions/action_space.h"

namespace evalbus::policy {

// What NumValues(form) values say, as a unit quaternion; the identity for kNone. Quaternions are normalized,
// and 6D forms made orthonormal by Gram-Schmidt (Zhou et al., "On the Continuity of Rotation Representations
// in Neural Networks", CVPR 2019). Throws std::runtime_error, one line, for what is no rotation: a value that
// is not finite, a quaternion or a column of a 6D form without a length, two parallel columns.
Eigen::Quaterniond ReadRotation(RotationForm form, std::span<const double> values);

// The other way, into NumValues(form) values. `rotation` is a unit quaternion. Its sign is kept by the
// quaternion forms and matters to kAxisAngleRobosuite, which makes an angle from pi to 2 pi of a negative w
// (and the zero vector of w = +-1); kAxisAngle is the shortest, up to pi. Euler angles: the second is within
// +-pi/2, and where it is at one of its ends the third is 0.
void WriteRotation(RotationForm form, const Eigen::Quaterniond& rotation, std::span<double> values);

}  // namespace evalbus::policy
