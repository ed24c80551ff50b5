// Classifies why an episode did not succeed, as one identifier of a fixed list. docs/metrics.md lists the
// rules.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "evalbus/condition_t.hpp"
#include "metrics/episode/episode_history.h"
#include "metrics/roboeval/slips.h"
#include "metrics/task/task_evaluator.h"
#include "models/model_names.h"

namespace evalbus::metrics {

// The sim ended the episode on a verdict that the available ticks do not confirm.
inline constexpr char kUnconfirmed[] = "unconfirmed";

// Outcome of an episode and the data from which the failure reason is derived.
struct EpisodeOutcome {
  const ModelNames& names;
  const EpisodeHistory& history;
  const std::vector<Slip>& slips;
  Verdict verdict = Verdict::kUndecided;
  // False if the source does not provide what success or failure depends on.
  bool can_succeed = true;
  bool out_of_bounds = false;
  // End reason as in episode_end_t, and the last tick with a sample.
  std::string end_reason;
  int64_t last_tick = 0;
  // Deciding conditions; see explanation_t.
  std::vector<condition_t> conditions;
  // For each stage that was not reached, and for success: the conditions that are not met.
  std::vector<condition_t> unmet;
};

// Returns an empty string on success, and server_error for an invalid episode, whatever its verdict.
std::string FailureReason(const EpisodeOutcome& outcome);

}  // namespace evalbus::metrics
