// Makes one run of several that hold parts of its episodes.
#pragma once

#include <filesystem>
#include <vector>

#include "cli/plans/plan_folder.h"

namespace evalbus::plans {

// Run folders with some of the episodes each (--only) become `out`, which is not there yet: what one run of
// all of them would have written. Episodes' files are linked where that can be, so that they take no room
// twice. Throws InputError where they are no parts of one run, or an episode is in two of them.
void MergeRuns(const std::vector<std::filesystem::path>& parts, const std::filesystem::path& out);

// Merges what the shards of a plan have brought: each run whose shards are all there, then each suite whose
// runs are; done twice, at the same time even, it is as done once. Returns the shards that are missing.
std::vector<Shard> MergePlan(const PlanFolder& folder);

}  // namespace evalbus::plans
