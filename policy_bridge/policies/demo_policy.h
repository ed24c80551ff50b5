// Plays a RoboEval demonstration open loop on the corresponding evalbus task.
#pragma once

#include <filesystem>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"
#include "policy_bridge/policies/demonstration.h"

namespace evalbus::policy {

// Episode i plays the i-th file. The steps of the demonstration that fall into a tick are combined by
// RoboEval's own rule: the mean of the joint targets and the last gripper commands, of which values above 0.5
// close the gripper. After the end of the demonstration, the last step is held. The scene is drawn from
// evalbus' seed, because the file does not contain RoboEval's scene.
class DemoPolicy : public Policy {
 public:
  // Throws InputError unless the robot has two arms with 7 joints and a gripper each.
  DemoPolicy(std::vector<std::filesystem::path> files, const model_info_t& info);
  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 private:
  std::vector<std::filesystem::path> files_;
  double tick_s_;
  Demonstration demo_;
};

}  // namespace evalbus::policy
