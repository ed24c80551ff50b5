// Finds the logs of recorded episodes.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::results {

// Returns the log of an episode, or the logs of the finished episodes of a run or a suite, ordered by run and
// episode. `recording` is the folder of a suite, a run or an episode, or a log file. If `episodes` is not
// empty, only the logs of these episodes of each run are returned, in the order of `episodes`; it is ignored
// for an episode's folder and a log file.
// Throws InputError if there is no log, or if a run with finished episodes lacks one of `episodes`.
std::vector<std::filesystem::path> EpisodeLogs(const std::filesystem::path& recording,
                                               const std::vector<int>& episodes = {});

// Throws InputError if --episode selects episodes although `recording` is an episode's folder or a log file,
// for which EpisodeLogs() ignores them.
void CheckHasEpisodes(const std::filesystem::path& recording, const std::vector<int>& episodes);

// Returns the run.json of the run to which a log belongs; nullopt for a log that is not in the folder of a
// run with a run.json.
std::optional<RecordedRun> RunOf(const std::filesystem::path& log);

}  // namespace evalbus::results
