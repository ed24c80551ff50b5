// Merges folders that each contain some episodes of a run into one run.
#pragma once

#include <filesystem>
#include <vector>

#include "plans/plan_folder.h"

namespace evalbus::plans {

// Merges run folders that each contain some episodes of a run (--only) into the run folder `out`, which must
// not exist. `out` then contains the same results as a single run of all episodes. Episode files are
// hard-linked where possible, so that they use no additional disk space. Throws InputError if the folders are
// not parts of one run, if two of them contain the same episode, if one is a collection of demonstrations, or
// if a log is damaged or missing.
void MergeRuns(const std::vector<std::filesystem::path>& parts, const std::filesystem::path& out);

// Merges the results of a plan's shards. First merges each run whose shards have all finished, then writes
// each suite whose runs have all been merged. Idempotent, and safe to call from several processes at the same
// time. Returns the missing shards.
std::vector<Shard> MergePlan(const PlanFolder& folder);

}  // namespace evalbus::plans
