// Replays recorded actions.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bus/episode_reader.h"
#include "policy_bridge/interface/policy.h"

namespace evalbus::policy {

// An episode with its actions, and the log from which it was read. If there are no actions, the recording
// does not contain the episode.
struct RecordedActions {
  std::string log;
  EpisodeMessages episode;
};
using Recording = std::function<RecordedActions(int episode)>;

// Opens a run folder or an LCM event log. The actions of an episode are read when they are requested. Throws
// InputError if the path does not exist, or if it is a folder other than a run folder. The returned function
// throws InputError if the log is damaged, or lacks actions or the end of the episode.
Recording OpenRecording(const std::string& path);

// Returns PATH for a policy named "replay:PATH" or "replay_anyway:PATH", and an empty text for other
// policies.
std::string RecordingPath(const std::string& policy);

// Replays the recorded actions of the episode with the same index. Each tick executes the last action whose
// simulated time has been reached, so a recording can be replayed at a different control rate.
class ReplayPolicy : public Policy {
 public:
  // anyway: accepts a recording of a different task, variation, robot (with the same numbers of joints and
  // grippers), seed, control rate or physics model, although the actions then have other effects. Otherwise,
  // such a recording is rejected.
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
