// How long a policy's server took, and how that counted: beside a run's scores and apart from them, since no
// two runs agree.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/results/run_reader.h"
#include "evalbus/policy_action_t.hpp"

namespace evalbus::results {

// The calls of an episode, for episodes/0007/policy_calls.json (docs/run_folder.md).
class PolicyCalls {
 public:
  void Add(const policy_action_t& action) {
    calls_.push_back({action.header.tick, action.answered_s, action.server_s, action.held_ticks});
  }
  // Removes the call about the tick at which a verdict or the time limit ended the episode. The policy is
  // asked while that tick is scored, so whether the answer arrives before the end is chance, and it decides
  // nothing.
  void RemoveUndecided(int64_t last_tick);
  bool empty() const { return calls_.empty(); }
  nlohmann::ordered_json Json() const;

 private:
  struct Call {
    int64_t tick;
    double answered_s, server_s;
    int64_t held_ticks;
  };
  std::vector<Call> calls_;
};

// What a reader of the scores of a policy behind a server has to know, a sentence each: what its contract
// says, what its thinking cost in simulated time, how long its server took. Empty for other policies.
std::vector<std::string> PolicyNotes(const RecordedRun& run);

}  // namespace evalbus::results
