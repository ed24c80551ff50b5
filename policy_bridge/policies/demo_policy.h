// Plays a RoboEval demonstration open loop on the corresponding evalbus task.
#pragma once

#include <filesystem>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"
#include "policy_bridge/policies/demonstration.h"

namespace evalbus::policy {

// Episode i plays the i-th file. Each tick commands the demonstration's steps that fall into it, combined by
// RoboEval's own rule: the mean of the joints and the last value of the grippers. After the end, the last
// step is held. The scene is drawn from evalbus' seed, because the file does not contain RoboEval's scene.
class DemoPolicy : public Policy {
 public:
  // Throws InputError unless the robot has 7 + 7 joints and two grippers.
  DemoPolicy(std::vector<std::filesystem::path> files, const model_info_t& info);
  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 private:
  std::vector<std::filesystem::path> files_;
  double tick_s_;
  Demonstration demo_;
};

}  // namespace evalbus::policy
