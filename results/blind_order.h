// The order in which an operator judges the episodes of two runs without knowing which run is shown.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::results {

// An episode to judge; run: index among the runs that are judged together.
struct JudgedEpisode {
  int run = 0, episode = 0;
  auto operator<=>(const JudgedEpisode&) const = default;
};

// The episodes of both runs that have equal seeds, in the order of the first run's episodes. Throws
// InputError if the runs are of different tasks or variations, or have no seed in common.
std::vector<std::pair<int, int>> EpisodesOfEqualSeeds(const RecordedRun& a, const RecordedRun& b);

// The pairs in random order; within a pair, run 0 comes first in half of the pairs (in one more or one fewer
// than half if their number is odd), also drawn at random. After every second episode, both runs have been
// shown equally often. Equal seeds give equal orders.
std::vector<JudgedEpisode> BlindOrder(const std::vector<std::pair<int, int>>& pairs, int64_t seed);

}  // namespace evalbus::results
