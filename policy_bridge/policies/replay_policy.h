// Plays recorded actions again.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"

namespace evalbus::policy {

// The actions that were recorded of an episode, in the order of their ticks; empty if there are none.
using Recording = std::function<std::vector<action_t>(int episode)>;

// Actions in a run folder or in an LCM event log, read when an episode is asked for. Throws InputError if
// there is no such thing.
Recording OpenRecording(const std::string& path);

// Repeats the recorded actions of the episode with the same number. At each tick that is the last one whose
// simulated time has come, so a recording plays at another control rate too.
class ReplayPolicy : public Policy {
 public:
  ReplayPolicy(Recording recording, const model_info_t& info);
  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 private:
  Recording recording_;
  size_t num_joints_, num_grippers_;
  std::vector<action_t> actions_;
  size_t next_ = 0;
};

}  // namespace evalbus::policy
