// Generates the report of a run or a suite as an HTML page, from run folders and logs.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::report {

// A page, and the sentence that its command prints about it.
struct BuiltPage {
  std::string html;
  // A sentence that states which episodes can be played in 3D; empty if none were requested.
  std::string note;
  // Shown episodes whose logs are damaged or incomplete, and episodes that cannot be shown, with the reason.
  std::vector<std::string> remarks = {};
};

// Returns the command line that repeats a run, from the contents of its run.json; empty if there is none.
using CommandOf = std::function<std::string(const nlohmann::ordered_json& run_json)>;

// Returns the HTML page. file: where the page will be written; links are relative to it. episodes: the
// episodes whose curves are drawn and which can be played in 3D. If empty, the page selects
// the curves (for example of the first failures), and has as many episodes in 3D as fit. made_by: version and
// commit. most: maximum size of the page in bytes with its viewer; 0: no viewer and no images. Throws
// InputError or EnvironmentError.
BuiltPage RunReport(results::RecordedRuns runs, const std::filesystem::path& file,
                    const std::vector<int>& episodes, const std::string& made_by, size_t most,
                    const CommandOf& command_of);

}  // namespace evalbus::report
