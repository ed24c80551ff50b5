// Generates contracts for environments from a short description of observations and actions.
#pragma once

#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/contract/contract.h"

namespace evalbus::runner {

struct ContractForm {
  // Kind of action; one of ControlNames().
  std::string control = "joint";
  // Cameras whose images are observed.
  std::vector<std::string> cameras;
  int width_px = 224, height_px = 224;
};

// Returns the accepted names for messages: "joint, joint_delta, ...".
std::string ControlNames();

// Returns the contract for this robot. Observations contain the joint positions and gripper openings of all
// arms as "state", and images as ["images", CAMERA]. Actions contain the values of all arms, followed by the
// values of the grippers (0 open, 1 closed). Throws InputError for an unknown control.
policy::Contract MakeContract(const ContractForm& form, double rate_hz, const model_info_t& model);

// Usual range of each value of an action. Joint and gripper positions have their limits, positions of poses
// -2 to 2 m, and angles -pi to pi. Steps and velocities correspond to at most 2 rad/s and 0.5 m/s. All values
// are unlimited if the contract has a scale or an offset, and so are the values of poses and pose steps whose
// rotations do not have three values.
struct ActionBounds {
  std::vector<double> lower, upper;
};
ActionBounds BoundsOf(const policy::ActionSpace& space, const model_info_t& model);

}  // namespace evalbus::runner
