// Replays recorded actions.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"

namespace evalbus::policy {

// The actions of an episode in tick order, and the messages that they were recorded with. No actions: the
// episode is not in the recording.
struct RecordedEpisode {
  std::string log;
  // Default-constructed if the log does not contain them.
  model_info_t model{};
  episode_begin_t begin{};
  std::vector<action_t> actions;
};
using Recording = std::function<RecordedEpisode(int episode)>;

// Actions in a run folder or an LCM event log, read when an episode is requested. Throws InputError if the
// path is neither.
Recording OpenRecording(const std::string& path);

// PATH of a policy named "replay:PATH" or "replay_anyway:PATH"; empty for other policies.
std::string RecordingPath(const std::string& policy);

// Replays the recorded actions of the episode with the same number. Each tick gets the last action whose
// simulated time has been reached, so a recording can be replayed at another control rate.
class ReplayPolicy : public Policy {
 public:
  // anyway: allows a recording of another task, variation, robot, seed or control rate, for which the same
  // actions have other effects; without it, such a recording is rejected.
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
