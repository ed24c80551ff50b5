// Where the logs of recorded episodes are.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace evalbus::results {

// The log of an episode, or the logs of the finished episodes of a run, in order; of one of them with
// `episode`. `run_or_log` is a run folder, an episode's folder or a log file. Throws InputError if there is
// none.
std::vector<std::filesystem::path> EpisodeLogs(const std::filesystem::path& run_or_log,
                                               std::optional<int> episode = std::nullopt);

}  // namespace evalbus::results
