// How often a policy's server was called, how long it took, and the resulting delay. Reported separately from
// the scores, because it differs between identical runs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "evalbus/policy_action_t.hpp"
#include "results/run_reader.h"

namespace evalbus::results {

// Schedule by which a contract calls its server: from tick settle_steps on, each time after execute_steps
// actions of the last answer were executed.
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
  // Removes the call for the tick at which a verdict or the time limit ended the episode. The policy is
  // called while that tick is scored, so whether the answer arrives in time is random, and it has no effect.
  void RemoveUndecided(int64_t last_tick);

  // num_ticks: ticks of the episode, without the reset state.
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

// Returns a warning if the policy was called less than half as often as scheduled; otherwise empty.
// `episodes`: values of PolicyCalls::Json().
std::string RareCallsWarning(const std::vector<nlohmann::ordered_json>& episodes);

// Notes on the scores of a policy behind a server, one sentence each: RareCallsWarning(), properties of its
// contract, its delay in simulated time, its server's response time. Empty for other policies.
std::vector<std::string> PolicyNotes(const RecordedRun& run);

}  // namespace evalbus::results
