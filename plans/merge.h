// Merges runs that each hold some of a run's episodes into one run.
#pragma once

#include <filesystem>
#include <vector>

#include "plans/plan_folder.h"

namespace evalbus::plans {

// Merges run folders that each hold some of a run's episodes (--only) into the run folder `out`, which must
// not exist. `out` equals what a single run of all episodes would have written. Episode files are hard-linked
// where possible, so that they use no additional disk space. Throws InputError if the folders are not parts
// of one run, or if an episode is in two of them.
void MergeRuns(const std::vector<std::filesystem::path>& parts, const std::filesystem::path& out);

// Merges the results of a plan's shards: each run whose shards are all there, then each suite whose runs are
// all there. Idempotent, and safe to call from several processes at the same time. Returns the missing
// shards.
std::vector<Shard> MergePlan(const PlanFolder& folder);

}  // namespace evalbus::plans
