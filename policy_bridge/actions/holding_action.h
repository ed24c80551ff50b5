// The action of a policy that has not computed an action yet.
#pragma once

#include "evalbus/action_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::policy {

// Returns an action that keeps all joints at their positions in `state` and opens the grippers. Its header is
// empty.
inline action_t HoldingAction(const state_t& state) {
  action_t action{};
  action.mode = action_t::JOINT_POSITION;
  for (const arm_state_t& arm : state.arm) {
    action.joint_position_rad.insert(action.joint_position_rad.end(), arm.joint_position_rad.begin(),
                                     arm.joint_position_rad.end());
  }
  action.num_joints = static_cast<int32_t>(action.joint_position_rad.size());
  action.gripper_closing.assign(state.gripper.size(), 0.0);
  action.num_grippers = static_cast<int32_t>(action.gripper_closing.size());
  return action;
}

}  // namespace evalbus::policy
