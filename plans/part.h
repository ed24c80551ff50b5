// Runs a part of a plan, which is a subset of its shards. Each shard is evaluated on this machine's local
// disk and then copied into the plan's folder. An interrupted shard is run again from its first episode.
// Shards that other parts have finished are kept.
#pragma once

#include "plans/plan_folder.h"

namespace evalbus::plans {

// Runs part `part` (from 1) of `parts`, at most `workers` shards at a time. Throws InputError and
// EnvironmentError. If a shard fails, EnvironmentError is thrown after all other shards were run.
void RunPart(const PlanFolder& folder, int part, int parts, int workers);

}  // namespace evalbus::plans
