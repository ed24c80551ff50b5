// The report of a run or a suite as an HTML page, from run folders and logs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/built_page.h"
#include "results/run_reader.h"

namespace evalbus::report {

// Returns the HTML page. file: where the page will be written; links are relative to it. episodes: those
// whose curves are drawn and which can be played in 3D; if empty, curves of the first failures and of the
// success with the median time, and in 3D as many episodes as fit. made_by: version and commit. most: maximum
// size of the page in bytes with its viewer; 0: no viewer. Throws InputError, EnvironmentError.
BuiltPage RunReport(results::RecordedRuns runs, const std::filesystem::path& file,
                    const std::vector<int>& episodes, const std::string& made_by, size_t most);

}  // namespace evalbus::report
