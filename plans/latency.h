// A policy's success against its inference delay: a plan with one entry for each delay and execution mode.
#pragma once

#include <string>
#include <vector>

#include "plans/plan_folder.h"
#include "results/latency_curve.h"

namespace evalbus::plans {

// Returns the plan. options: those of every run; they name one task and one policy. delays_ms: in
// milliseconds; executions: as for --execution. Throws InputError.
Plan LatencyPlan(const runner::RunOptions& options, const std::vector<std::string>& delays_ms,
                 const std::vector<std::string>& executions, bool rate_is_given);

// Runs the missing episodes of such a plan, at most `workers` runs at a time, and writes latency.json,
// latency.csv and latency.svg into its folder. Throws InputError, EnvironmentError.
std::vector<results::DelayPoint> RunLatencyPlan(const PlanFolder& folder, int workers);

}  // namespace evalbus::plans
