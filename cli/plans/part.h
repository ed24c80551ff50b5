// A part of a plan: some of its shards, each evaluated on this machine's own disk and then put into the
// plan's folder. What a part was interrupted in begins again; what another one has done stays.
#pragma once

#include "cli/plans/plan_folder.h"

namespace evalbus::plans {

// Runs part `part` (from 1) of `parts`, so many shards at a time. Throws InputError; EnvironmentError also
// where a shard failed, after all others were tried.
void RunPart(const PlanFolder& folder, int part, int parts, int workers);

}  // namespace evalbus::plans
