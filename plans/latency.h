// Measures a policy's success as a function of its inference delay, with a plan that has one entry for each
// delay and execution mode.
#pragma once

#include <string>
#include <vector>

#include "plans/plan_folder.h"
#include "results/latency_curve.h"

namespace evalbus::plans {

// Returns the plan. options: options of every run, with one task and one policy. delays_ms: delays in
// milliseconds; of delays that are equally many ticks, only the first is used. executions: values of
// --execution. Prints a note on delays that are not whole ticks. For a scripted policy, leaves
// out rtc with a note if asynchronous is also given. Throws InputError.
Plan LatencyPlan(const runner::RunOptions& options, const std::vector<std::string>& delays_ms,
                 const std::vector<std::string>& executions, bool rate_is_given);

struct LatencyResults {
  std::vector<results::DelayPoint> points;
  std::vector<results::DelayEffect> effects;
};

// Runs the missing episodes of a plan from LatencyPlan(), at most `workers` runs at a time, and writes
// latency.json, latency.csv and latency.svg into its folder. Throws InputError or EnvironmentError.
LatencyResults RunLatencyPlan(const PlanFolder& folder, int workers);

}  // namespace evalbus::plans
