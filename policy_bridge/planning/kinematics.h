// Forward kinematics and Jacobian of one arm. The serial chain from the world to the wrist is extracted once
// from a compiled model. It is then evaluated without MuJoCo, in well under a microsecond.
#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <vector>

#include "evalbus/arm_info_t.hpp"

namespace evalbus::policy {

inline constexpr int kMaxArmJoints = 8;
// Sizes up to kMaxArmJoints are stored inside the object, without allocation.
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxArmJoints, 1>;
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMaxArmJoints>;

// Converts a pose from MuJoCo's arrays; quat is (w, x, y, z).
Eigen::Isometry3d ToPose(const mjtNum* position, const mjtNum* quat);

class ArmChain {
 public:
  // Throws InputError unless the arm has 1 to kMaxArmJoints joints, which are exactly the joints between the
  // world and the wrist site, in their order, and each is a hinge.
  ArmChain(const mjModel& model, const arm_info_t& arm);

  int num_joints() const { return static_cast<int>(joints_.size()); }
  const JointVector& lower() const { return lower_; }  // rad
  const JointVector& upper() const { return upper_; }  // rad
  const JointVector& home() const { return home_; }    // rad

  // Returns the pose of the wrist in the world frame for joint positions q (rad).
  Eigen::Isometry3d Forward(const JointVector& q) const { return Forward(q, nullptr); }

  // Returns the rotation of the wrist in the world frame. It is the product of the quaternions of bodies and
  // joints along the arm, as MuJoCo computes it for a body, so its sign never jumps as the arm moves.
  Eigen::Quaterniond Rotation(const JointVector& q) const;

  // Returns the pose and Jacobian of the wrist in the world frame. Rows 0 to 2 of the Jacobian yield the
  // linear velocity (m/s), rows 3 to 5 the angular velocity (rad/s).
  Eigen::Isometry3d Forward(const JointVector& q, Jacobian* jacobian) const;

 private:
  struct Joint {
    // Constant transform from the previous joint (or the world) to the joint's anchor.
    Eigen::Isometry3d before;
    Eigen::Vector3d axis;
    // Angle in the model's reference configuration, rad.
    double reference;
  };

  std::vector<Joint> joints_;
  // Constant transform from the last joint's anchor to the wrist.
  Eigen::Isometry3d wrist_;
  JointVector lower_, upper_, home_;
};

}  // namespace evalbus::policy
