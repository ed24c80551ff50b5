// Comparisons as an HTML page: converts the structs of comparison.h to those of report/page.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/built_page.h"
#include "results/comparison.h"

namespace evalbus::report {

// Returns the HTML page. `file`: where the page will be written; links to videos are relative to it.
// `made_by`: version and commit. `most`: maximum size of the page in bytes, including pairs of episodes for
// 3D playback, flipped seeds first; 0: no 3D playback. Throws InputError if the runs can no longer be read,
// EnvironmentError if three.js is missing.
BuiltPage ComparisonReport(const std::vector<results::Comparison>& comparisons,
                           const std::filesystem::path& file, const std::string& made_by, size_t most);

}  // namespace evalbus::report
