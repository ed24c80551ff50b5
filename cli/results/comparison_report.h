// Comparisons as a page: from the structs of comparison.h to those of viz/report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/results/comparison.h"

namespace evalbus::results {

struct ComparisonPage {
  std::string html;
  // Which episodes are shown in 3D, a sentence; empty: none were asked for.
  std::string note;
};

// The HTML page, to be written to this file, so that it links videos. `made_by`: version and commit. most:
// bytes that it may have with pairs of episodes shown in 3D, flipped seeds first; 0: none are. Throws
// InputError where the runs cannot be read any more, EnvironmentError without three.js.
ComparisonPage ComparisonReport(const std::vector<Comparison>& comparisons, const std::filesystem::path& file,
                                const std::string& made_by, size_t most);

}  // namespace evalbus::results
