// Contracts of environments: observations and actions that a few words describe.
#pragma once

#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/contract/contract.h"

namespace evalbus::runner {

struct ContractForm {
  // One of ControlNames().
  std::string control = "joint";
  // Cameras whose images are observed.
  std::vector<std::string> cameras;
  int width_px = 224, height_px = 224;
};

// "joint, joint_delta, ...", for messages.
std::string ControlNames();

// Returns the contract for this robot: joint positions and gripper openings of all arms as "state", images as
// ["images", CAMERA], and actions with the values of all arms, then those of the grippers (0 open, 1 closed).
// Throws InputError for an unknown control.
policy::Contract MakeContract(const ContractForm& form, double rate_hz, const model_info_t& model);

// Usual range of each value of an action. Joint and gripper positions: their limits. Poses: 2 m and one turn.
// Steps: those of 2 rad/s and 0.5 m/s. Unlimited for values that the contract scales.
struct ActionBounds {
  std::vector<double> lower, upper;
};
ActionBounds BoundsOf(const policy::ActionSpace& space, const model_info_t& model);

}  // namespace evalbus::runner
