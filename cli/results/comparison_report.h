// Comparisons as a page: from the structs of compare.h to those of viz/report.
#pragma once

#include <string>
#include <vector>

#include "cli/results/comparison.h"

namespace evalbus::results {

// The HTML page. `made_by`: version and commit.
std::string ComparisonReport(const std::vector<Comparison>& comparisons, const std::string& made_by);

}  // namespace evalbus::results
