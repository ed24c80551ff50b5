// Converts comparisons to JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "results/comparison.h"
#include "results/ranking.h"

namespace evalbus::results {

nlohmann::ordered_json SuccessJson(const SuccessComparison& success);

nlohmann::ordered_json ComparisonJson(const std::vector<Comparison>& comparisons,
                                      const std::vector<RankedRun>& ranking = {});

}  // namespace evalbus::results
