// Records how often a policy computed an answer, how long this took, and the resulting delay. Reported
// separately from the scores, because a server's computation times differ between identical runs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "evalbus/episode_summary_t.hpp"
#include "evalbus/policy_action_t.hpp"
#include "policy_bridge/actions/chunk_schedule.h"
#include "results/run_reader.h"

namespace evalbus::results {

// Schedule by which a policy is called. The first call is at tick settle_steps; each further call follows
// when execute_steps actions of the last answer have been executed.
struct CallSchedule {
  int execute_steps = 1;
  int settle_steps = 0;
  policy::Execution execution = policy::Execution::kSynchronous;
  // Number of actions in an action chunk; 0: each answer may have a different number.
  int chunk_steps = 0;
};

// The calls of an episode, for episodes/0007/policy_calls.json (docs/run_folder.md).
class PolicyCalls {
 public:
  // Ignores a repeated message.
  void Add(const policy_action_t& action) {
    if (!calls_.empty() && action.header.tick <= calls_.back().tick) return;
    calls_.push_back({action.header.tick, action.header.tick + action.held_ticks, action.num_steps,
                      action.answered_s, action.server_s});
  }
  // Removes the call for the tick at which a verdict or the time limit ended the episode. The policy is
  // called while that tick is scored. Whether its answer arrives before the episode ends depends on timing,
  // and the answer has no effect. Without this call, equal runs have equal results.
  void RemoveUndecided(int64_t last_tick);

  // Returns false if a call that the schedule requires in lockstep is missing because its message was lost.
  bool IsWhole(const CallSchedule& schedule, int64_t num_ticks) const;

  // num_ticks: number of ticks that the episode's values cover (ScoredTicks()).
  nlohmann::ordered_json Json(const CallSchedule& schedule, int64_t num_ticks) const;

 private:
  struct Call {
    int64_t tick;
    // First tick at which the answer was executed.
    int64_t executed_from;
    int num_steps;
    double answered_s, server_s;
  };
  std::vector<Call> calls_;
};

// Returns the number of ticks that the episode's values cover: all ticks up to the first success or failure
// or, without either, up to the end; tick 0 is not counted.
int64_t ScoredTicks(const episode_summary_t& summary);

// Adds the metrics of a policy's delay (docs/metrics.md) to the line of an episode: stale_action_ratio,
// effective_hz and action_age_s. A metric without a value is null. The metrics process cannot compute them,
// because STATE does not show which actions are new. `calls`: value of PolicyCalls::Json().
void AddDelayMetrics(const nlohmann::ordered_json& calls, const episode_summary_t& summary,
                     nlohmann::ordered_json* line);
// Returns true if the line has these metrics; lines of older versions have none.
bool HasDelayMetrics(const nlohmann::ordered_json& line);

// Returns a warning if the policy was called less than half as often as scheduled; otherwise empty.
// `episodes`: values of PolicyCalls::Json().
std::string RareCallsWarning(const std::vector<nlohmann::ordered_json>& episodes);

// Returns notes on the scores of a policy that is behind a server or has an inference delay (--latency), one
// sentence each. They state the delay in simulated time. For a policy behind a server, also
// RareCallsWarning(), properties of its contract, and the server's response time. Empty for other policies.
std::vector<std::string> PolicyNotes(const RecordedRun& run);

}  // namespace evalbus::results
