// Determines the order in which an operator judges the episodes of two runs without knowing which run is
// shown.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::results {

// An episode to judge. run: index of its run among the runs that are judged together.
struct JudgedEpisode {
  int run = 0, episode = 0;
  auto operator<=>(const JudgedEpisode&) const = default;
};

// Returns the episodes of both runs that have equal seeds, in the order of the first run's episodes. Throws
// InputError if the runs have different tasks or variations, or no seed in common.
std::vector<std::pair<int, int>> EpisodesOfEqualSeeds(const RecordedRun& a, const RecordedRun& b);

// Returns a text that differs between runs and does not change if a run is resumed or its folder is renamed:
// the SHA-256 of values of its run.json.
std::string RunIdentity(const RecordedRun& run);

// Returns the pairs in random order; run 0 comes first in a random half of the pairs (if their number is odd,
// half of it is rounded up or down at random). The two episodes of a pair follow each other, so both runs are
// shown equally often. Equal seeds give equal orders.
std::vector<JudgedEpisode> BlindOrder(const std::vector<std::pair<int, int>>& pairs, int64_t seed);

}  // namespace evalbus::results
