// A part of a plan: a subset of its shards. Each shard is evaluated on this machine's local disk and then
// copied into the plan's folder. An interrupted shard starts over; shards finished by other parts are kept.
#pragma once

#include "plans/plan_folder.h"

namespace evalbus::plans {

// Runs part `part` (from 1) of `parts`, at most `workers` shards at a time. Throws InputError. Throws
// EnvironmentError also if a shard failed, after all other shards have been tried.
void RunPart(const PlanFolder& folder, int part, int parts, int workers);

}  // namespace evalbus::plans
