// How an episode ended, as input to its cause and its failure reason. docs/metrics.md lists the rules.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "evalbus/condition_t.hpp"
#include "metrics/cause/cause_finder.h"
#include "metrics/roboeval/slips.h"
#include "metrics/task/task_evaluator.h"
#include "models/model_names.h"

namespace evalbus::metrics {

// The sim ended the episode on a verdict that the available ticks do not confirm.
inline constexpr char kUnconfirmed[] = "unconfirmed";

// Outcome of an episode.
struct EpisodeOutcome {
  const ModelNames& names;
  const std::vector<Slip>& slips;
  Verdict verdict = Verdict::kUndecided;
  // False if the source does not provide what success or failure depends on.
  bool can_succeed = true;
  bool out_of_bounds = false;
  // The members of the same names in episode_end_t.
  std::string end_reason;
  std::string end_detail;
  // Tick of the verdict; without a verdict, the last tick.
  int64_t last_tick = 0;
  // Deciding conditions; see explanation_t.
  std::vector<condition_t> conditions;
};

// Returns how the episode ended. Ends that have nothing to do with objects are By::kOther with their failure
// reason. A server_error is always By::kOther, even after a verdict, because it makes the episode invalid.
CauseEnd MakeCauseEnd(const EpisodeOutcome& outcome);

}  // namespace evalbus::metrics
