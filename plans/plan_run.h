// Runs a whole plan on this machine.
#pragma once

#include "plans/plan_folder.h"
#include "plans/plan_report.h"
#include "runner/json_events.h"

namespace evalbus::plans {

// Runs the missing episodes, at most `workers` runs at a time, then calls FinishPlan(). Throws InputError,
// EnvironmentError.
void RunPlan(const PlanFolder& folder, int workers, const runner::RunOutput& output);

// Runs the missing episodes of a plan without Plan::until, at most `workers` runs at a time. Throws
// InputError or EnvironmentError.
void RunAllEpisodes(const PlanFolder& folder, int workers);

// Completes a plan whose runs have all finished, for example after a merge. Records the videos, writes the
// pages, and prints the comparisons to stdout. Returns the results. Throws InputError, and EnvironmentError,
// for example after everything else is done if videos could not be recorded.
PlanResults FinishPlan(const PlanFolder& folder, int workers);

}  // namespace evalbus::plans
