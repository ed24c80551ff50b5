// Plays a demonstration of RoboEval on our task, open loop.
#pragma once

#include <filesystem>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"
#include "policy_bridge/policies/demonstration.h"

namespace evalbus::policy {

// Episode i plays the i-th file. Each tick commands what RoboEval's own rule makes of the demonstration's
// steps in it, the mean of the joints and the last of the grippers; behind the end the last step is held. Our
// scene is drawn from our seed: RoboEval's is not in the file.
class DemoPolicy : public Policy {
 public:
  // Throws InputError for another robot than one of 7 + 7 joints and two grippers.
  DemoPolicy(std::vector<std::filesystem::path> files, const model_info_t& info);
  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 private:
  std::vector<std::filesystem::path> files_;
  double tick_s_;
  Demonstration demo_;
};

}  // namespace evalbus::policy
