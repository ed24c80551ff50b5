// Computes joint targets that make the position servos of an arm follow a motion without delay or sag.
#pragma once

#include <mujoco/mujoco.h>

#include <vector>

#include "evalbus/model_info_t.hpp"
#include "models/mujoco_ptr.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {

// A servo with force kp (target - q) - kv dq/dt follows a target with a delay of kv / kp, and sags under the
// arm's weight unless the sim compensates gravity. The target that cancels both is
//   q + (kv dq/dt + g(q)) / kp
// where g is the torque against gravity (mj_rne without velocities). The target of a servo without kv only
// cancels the sag. The weight of held objects is not included.
class ServoLead {
 public:
  // Ignores actuators that are not position servos of the arms' joints.
  ServoLead(const mjModel& model, const model_info_t& info);

  // Writes the targets (rad) for the joint positions `wanted` (rad) and velocities (rad/s), one entry per
  // arm.
  void Lead(const std::vector<JointVector>& wanted, const std::vector<JointVector>& velocity,
            std::vector<JointVector>* targets);

 private:
  struct Servo {
    double stiffness = 0;  // N m / rad; 0: no servo
    double damping = 0;    // N m s / rad
    int qpos = 0, dof = 0;
  };
  // Private copy of the model, and its data. Null if the sim compensates gravity.
  ModelPtr model_;
  DataPtr data_;
  std::vector<mjtNum> gravity_;
  // One entry per arm and joint.
  std::vector<std::vector<Servo>> servos_;
};

}  // namespace evalbus::policy
