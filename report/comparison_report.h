// Writes comparisons as an HTML page, with links to videos and pairs of episodes for 3D playback.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "report/run_report.h"
#include "results/comparison.h"

namespace evalbus::report {

// Returns the HTML page. file: where the page will be written; links to videos are relative to it. made_by:
// version and commit. most: maximum size of the page in bytes, including pairs of episodes for 3D playback,
// flipped seeds first; 0: no 3D playback. source: see Page(). Throws InputError if the runs can no longer be
// read, EnvironmentError if three.js is missing.
BuiltPage ComparisonReport(const std::vector<results::Comparison>& comparisons,
                           const std::filesystem::path& file, const std::string& made_by, size_t most,
                           const nlohmann::ordered_json& source);

// Returns the source (see Page()) of a comparison's page that depends only on its runs.
nlohmann::ordered_json ComparisonSource(const std::vector<results::Comparison>& comparisons,
                                        const std::filesystem::path& file);

}  // namespace evalbus::report
