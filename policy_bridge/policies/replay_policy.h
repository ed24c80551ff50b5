// Plays recorded actions again.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"

namespace evalbus::policy {

// An episode's actions in the order of their ticks, and what they were the answers to. Without any, there is
// no such episode.
struct RecordedEpisode {
  std::string log;
  // Empty ones where the log has none.
  model_info_t model{};
  episode_begin_t begin{};
  std::vector<action_t> actions;
};
using Recording = std::function<RecordedEpisode(int episode)>;

// Actions in a run folder or in an LCM event log, read when an episode is asked for. Throws InputError if
// there is no such thing.
Recording OpenRecording(const std::string& path);

// PATH of a policy called "replay:PATH" or "replay_anyway:PATH"; empty for other policies.
std::string RecordingPath(const std::string& policy);

// Repeats the recorded actions of the episode with the same number. At each tick that is the last one whose
// simulated time has come, so a recording plays at another control rate too.
class ReplayPolicy : public Policy {
 public:
  // anyway: also where it was recorded in another task, variation, with another robot, seed or control rate,
  // where the same actions do something else; refused otherwise.
  ReplayPolicy(Recording recording, const model_info_t& info, bool anyway);
  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 private:
  Recording recording_;
  model_info_t info_;
  bool anyway_;
  std::vector<action_t> actions_;
  size_t next_ = 0;
};

}  // namespace evalbus::policy
