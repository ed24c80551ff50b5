// Numbers of a STATE by name, as policies are shown them: "left.joint_position_rad".
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
  // "ARM.WHAT" or "object.NAME.WHAT"; WHAT is one of SignalNames().
  std::string name;
  // Which of its values, in this order; empty: all.
  std::vector<int> indices;
  // Each value is multiplied, added to, then rounded to so many decimals (-1: not).
  double scale = 1, offset = 0;
  int decimals = -1;
  // Of poses.
  ActionFrame frame = ActionFrame::kWorld;
  EefPoint point = EefPoint::kFlange;

  // The pose of an object, which no robot knows.
  bool is_privileged() const { return name.starts_with("object."); }
};

// What of an arm, and of an object: joint_position_rad, gripper_opening, ...
const std::vector<std::string>& ArmSignalNames();
const std::vector<std::string>& ObjectSignalNames();

// Reads signals of a model's states.
class SignalReader {
 public:
  // Throws InputError for an arm, object or index that the model has not.
  SignalReader(const std::vector<Signal>& signals, const mjModel& model, const model_info_t& info);

  // One after the other.
  std::vector<double> Read(const state_t& state) const;

 private:
  std::vector<std::function<void(const state_t&, std::vector<double>*)>> readers_;
};

}  // namespace evalbus::policy
