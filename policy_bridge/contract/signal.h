// Signals: numbers of a STATE that observations refer to by name, such as "left.joint_position_rad".
#pragma once

#include <mujoco/mujoco.h>

#include <functional>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "policy_bridge/actions/action_space.h"

namespace evalbus::policy {

struct Signal {
  // "ARM.WHAT" or "object.NAME.WHAT", where WHAT is one of ArmSignalNames() or ObjectSignalNames().
  std::string name;
  // Indices of the values to use, in this order. Empty: all values.
  std::vector<int> indices;
  // Each value becomes value * scale + offset, rounded to `decimals` decimals (-1: not rounded).
  double scale = 1, offset = 0;
  int decimals = -1;
  // Used for poses only.
  ActionFrame frame = ActionFrame::kWorld;
  EefPoint point = EefPoint::kFlange;

  // Returns whether the signal is the pose of an object, which a real robot does not know.
  bool is_privileged() const { return name.starts_with("object."); }
};

// Return the valid values of WHAT for arms and for objects, such as joint_position_rad or gripper_opening.
const std::vector<std::string>& ArmSignalNames();
const std::vector<std::string>& ObjectSignalNames();

// Reads signals from the states of a model.
class SignalReader {
 public:
  // Throws InputError if the model does not have an arm, object or index of these signals.
  SignalReader(const std::vector<Signal>& signals, const mjModel& model, const model_info_t& info);

  // Returns the values of all signals, concatenated.
  std::vector<double> Read(const state_t& state) const;

 private:
  std::vector<std::function<void(const state_t&, std::vector<double>*)>> readers_;
};

}  // namespace evalbus::policy
