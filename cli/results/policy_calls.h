// How often a policy's server was called, how long it took, and what that cost: beside a run's scores and
// apart from them, since no two runs agree.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/results/run_reader.h"
#include "evalbus/policy_action_t.hpp"

namespace evalbus::results {

// How often a contract has its server called: from tick settle_steps on, each time execute_steps commands of
// the last answer were executed.
struct CallSchedule {
  int execute_steps = 1;
  int settle_steps = 0;
};

// The calls of an episode, for episodes/0007/policy_calls.json (docs/run_folder.md).
class PolicyCalls {
 public:
  void Add(const policy_action_t& action) {
    calls_.push_back(
        {action.header.tick, action.header.tick + action.held_ticks, action.answered_s, action.server_s});
  }
  // Removes the call about the tick at which a verdict or the time limit ended the episode. The policy is
  // asked while that tick is scored, so whether the answer arrives before the end is chance, and it decides
  // nothing.
  void RemoveUndecided(int64_t last_tick);

  // num_ticks: of the episode, without the reset state.
  nlohmann::ordered_json Json(const CallSchedule& schedule, int64_t num_ticks) const;

 private:
  struct Call {
    int64_t tick;
    // First tick at which the answer was executed.
    int64_t executed_from;
    double answered_s, server_s;
  };
  std::vector<Call> calls_;
};

// A line of warning where the policy of these episodes, each as of PolicyCalls::Json, was called less than
// half as often as it should have been; else empty.
std::string RareCallsWarning(const std::vector<nlohmann::ordered_json>& episodes);

// What a reader of the scores of a policy behind a server has to know, a sentence each: RareCallsWarning(),
// what its contract says, what its thinking cost in simulated time, how long its server took. Empty for other
// policies.
std::vector<std::string> PolicyNotes(const RecordedRun& run);

}  // namespace evalbus::results
