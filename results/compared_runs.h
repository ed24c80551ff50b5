// Prepares runs for `evalbus compare`: reads them, finds the baseline, gives them distinct names, and finds
// pairs of episodes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::results {

// Reads a run or suite, and computes the hash of its physics model from the model file in the run's folder.
// Comparable runs have equal hashes. Throws InputError.
RecordedRuns ReadForComparison(const std::filesystem::path& folder);

// Sets the hash of the run's physics model in its `info`. Throws InputError if the model cannot be read.
void SetPhysicsHash(RecordedRun* run);

// Removes the baseline from `runs` and returns it. `name` is a run's name, policy or folder; if empty, the
// first run is the baseline. A folder that is not among the runs is read. Throws InputError if `name` is
// unknown or ambiguous.
RecordedRuns RemoveBaseline(const std::string& name, std::vector<RecordedRuns>* runs);

// Returns the paths without the first and last parts that all of them share: "a" and "b" for
// {"plan/a/lift_pot", "plan/b/lift_pot"}. Returns the whole paths if one of them would be empty.
std::vector<std::string> DistinctNames(const std::vector<std::filesystem::path>& folders);
// Renames runs with equal names to the parts in which their folders differ.
void NameApart(std::vector<RecordedRuns>* runs);

// Two episodes of one task with the same seed, one from each run.
struct SeedPair {
  const RecordedRun* run;
  const RecordedRun* baseline;
  int64_t seed;
  int episode, baseline_episode;
};

// Searches all tasks that both have. Returns the first pair with the given seed. Without a seed, returns the
// first pair in which exactly one episode succeeded and both have a verdict or, if there is none, the first
// pair. nullopt if there is no such pair.
std::optional<SeedPair> FindSeedPair(const RecordedRuns& runs, const RecordedRuns& baselines,
                                     std::optional<int64_t> seed);

}  // namespace evalbus::results
