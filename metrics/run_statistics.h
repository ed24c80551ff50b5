// Statistics across the episodes of a run.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "evalbus/run_summary_t.hpp"
#include "metrics/statistics/wilson.h"

namespace evalbus {

// One finished episode.
struct EpisodeResult {
  // No tick missing, no sample refused.
  bool complete = false;
  bool success = false;
  // The result dictionary; whoever wants our own metrics in the statistics adds them under "extended".
  nlohmann::ordered_json metrics;
};

// Numbers and booleans (as 0 and 1) of a result dictionary by their flattened keys
// ("cartesian_path_length.left"), in the dictionary's order.
std::vector<std::pair<std::string, double>> FlattenedValues(const nlohmann::ordered_json& metrics);

// Rates and statistics over complete episodes. A metric's statistics are over the episodes that have it;
// metrics are sorted by first appearance. Standard deviation is the sample's (n - 1), NaN for one episode;
// the rate is NaN without complete episodes. The median of an even number is the mean of the middle two.
run_summary_t Summarize(const std::vector<EpisodeResult>& episodes);

}  // namespace evalbus
