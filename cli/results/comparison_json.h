// Comparisons for programs.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "cli/results/comparison.h"

namespace evalbus::results {

nlohmann::ordered_json ComparisonJson(const std::vector<Comparison>& comparisons);

}  // namespace evalbus::results
