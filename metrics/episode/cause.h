// Finds the decisive moment of an episode and describes it in one sentence. docs/failures.md has the rules.
#pragma once

#include <string>

#include "evalbus/cause_t.hpp"
#include "evalbus/explanation_t.hpp"
#include "metrics/episode/failure_reason.h"

namespace evalbus::metrics {

// `reason` is FailureReason(outcome), `end_s` the simulated time of the last tick with a sample.
cause_t FindCause(const EpisodeOutcome& outcome, const std::string& reason, const explanation_t& explanation,
                  double end_s);

}  // namespace evalbus::metrics
