// Selects what `evalbus compare` compares: reads the runs, finds the baseline among them, names them apart,
// and finds pairs of episodes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::results {

// Reads a run or suite. The hash of its physics model, which comparable runs share, is that of the model file
// beside run.json. Throws InputError.
RecordedRuns ReadForComparison(const std::filesystem::path& folder);

// Sets the hash of the run's physics model in its `info`. Throws InputError if the model cannot be read.
void SetPhysicsHash(RecordedRun* run);

// Removes the baseline from the runs and returns it; reads it if it is a folder but not one of them. name:
// name, policy or folder; empty: the first run. Throws InputError if it is unknown or ambiguous.
RecordedRuns RemoveBaseline(const std::string& name, std::vector<RecordedRuns>* runs);

// The parts of paths in which they differ: {"plan/a/lift_pot", "plan/b/lift_pot"} are "a" and "b". The whole
// paths if one of these parts would be empty.
std::vector<std::string> DistinctNames(const std::vector<std::filesystem::path>& folders);
// Names runs with equal names by the parts in which their folders differ.
void NameApart(std::vector<RecordedRuns>* runs);

// Two episodes of one task with the same seed, one of each run.
struct SeedPair {
  const RecordedRun* run;
  const RecordedRun* baseline;
  int64_t seed;
  int episode, baseline_episode;
};

// Searches all tasks that both have. Returns the pair with the given seed; without a seed, the first pair of
// which one succeeded and one failed, or, if there is none, the first pair.
std::optional<SeedPair> FindSeedPair(const RecordedRuns& runs, const RecordedRuns& baselines,
                                     std::optional<int64_t> seed);

}  // namespace evalbus::results
