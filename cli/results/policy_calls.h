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
  void Add(const policy_action_t& action);
  bool empty() const { return answered_s_.empty(); }
  nlohmann::ordered_json Json() const;

 private:
  std::vector<int64_t> tick_;
  std::vector<double> answered_s_, server_s_;
  int64_t held_ticks_ = 0;
};

// What a reader of the scores of a policy behind a server has to know, a sentence each: what its contract
// says, what its thinking cost in simulated time, how long its server took. Empty for other policies.
std::vector<std::string> PolicyNotes(const RecordedRun& run);

}  // namespace evalbus::results
