// Comparisons as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "cli/results/comparison.h"
#include "cli/results/ranking.h"

namespace evalbus::results {

nlohmann::ordered_json ComparisonJson(const std::vector<Comparison>& comparisons,
                                      const std::vector<RankedRun>& ranking = {});

}  // namespace evalbus::results
