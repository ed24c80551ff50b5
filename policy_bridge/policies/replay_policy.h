// Replays recorded actions.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bus/episode_reader.h"
#include "policy_bridge/interface/policy.h"

namespace evalbus::policy {

// An episode with its actions, and the log that it was read from. Without actions, the episode is not in the
// recording.
struct RecordedActions {
  std::string log;
  EpisodeMessages episode;
};
using Recording = std::function<RecordedActions(int episode)>;

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
