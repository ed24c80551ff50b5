// Why an episode did not succeed, as one word of a fixed list. The rules are those of docs/metrics.md.
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

// The sim ended the episode on a verdict that the ticks at hand do not give.
inline constexpr char kUnconfirmed[] = "unconfirmed";

// How an episode ended, and what is known of it.
struct EpisodeOutcome {
  const ModelNames& names;
  const EpisodeHistory& history;
  const std::vector<Slip>& slips;
  Verdict verdict = Verdict::kUndecided;
  // False where what success or failure asks for is not known.
  bool can_succeed = true;
  bool out_of_bounds = false;
  // As in episode_end_t, and the last tick with a sample.
  std::string end_reason;
  int64_t last_tick = 0;
  // What decided: see explanation_t.
  std::vector<condition_t> conditions;
  // Why each stage that was not reached is not, and why it is no success.
  std::vector<condition_t> unmet;
};

// Empty on success; of an invalid episode server_error, whatever the verdict was.
std::string FailureReason(const EpisodeOutcome& outcome);

}  // namespace evalbus::metrics
