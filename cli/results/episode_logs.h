// Where the logs of recorded episodes are.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "cli/results/run_reader.h"

namespace evalbus::results {

// The log of an episode, or the logs of the finished episodes of a run or of the runs of a suite, in order;
// with `episodes`, of these. `recording` is the folder of a suite, of a run or of an episode, or a log file,
// of which `episodes` are not looked for. Throws InputError if there is none.
std::vector<std::filesystem::path> EpisodeLogs(const std::filesystem::path& recording,
                                               const std::vector<int>& episodes = {});

// What run.json says of the run that a log is of; nothing for a log that is in no run folder.
std::optional<RecordedRun> RunOf(const std::filesystem::path& log);

}  // namespace evalbus::results
