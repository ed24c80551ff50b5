// Comparisons as a page: from the structs of comparison.h to those of viz/report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/results/comparison.h"

namespace evalbus::results {

// The HTML page, to be written to this file, so that it links films. `made_by`: version and commit.
std::string ComparisonReport(const std::vector<Comparison>& comparisons, const std::filesystem::path& file,
                             const std::string& made_by);

}  // namespace evalbus::results
