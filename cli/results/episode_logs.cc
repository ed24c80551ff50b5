#include "cli/results/episode_logs.h"

#include <algorithm>
#include <charconv>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/recorder/recorder.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;

// Numbers of the episodes that are finished: 0007.partial is not.
std::vector<int> FinishedEpisodes(const fs::path& run) {
  std::vector<int> episodes;
  for (const auto& entry : fs::directory_iterator(run / kEpisodesFolder)) {
    const std::string name = entry.path().filename().string();
    int episode = -1;
    const auto parsed = std::from_chars(name.data(), name.data() + name.size(), episode);
    if (parsed.ptr == name.data() + name.size() && fs::exists(entry.path() / kEventLog))
      episodes.push_back(episode);
  }
  if (episodes.empty()) throw InputError(run.string() + ": this run has no finished episode");
  std::sort(episodes.begin(), episodes.end());
  return episodes;
}

}  // namespace

std::vector<fs::path> EpisodeLogs(const fs::path& run_or_log, std::optional<int> episode) {
  const bool is_run = fs::is_directory(run_or_log / kEpisodesFolder);
  if (episode && !is_run) throw InputError("--episode: " + run_or_log.string() + " is no run folder");
  if (is_run) {
    std::vector<int> episodes = FinishedEpisodes(run_or_log);
    if (episode) {
      if (!std::binary_search(episodes.begin(), episodes.end(), *episode)) {
        throw InputError(run_or_log.string() + " has no finished episode " + std::to_string(*episode) +
                         "; it has " + std::to_string(episodes.size()) + ", " +
                         std::to_string(episodes.front()) + " to " + std::to_string(episodes.back()));
      }
      episodes = {*episode};
    }
    std::vector<fs::path> logs;
    for (const int i : episodes) logs.push_back(EpisodeLog(run_or_log, i));
    return logs;
  }
  if (fs::exists(run_or_log / kEventLog)) return {run_or_log / kEventLog};
  if (fs::is_regular_file(run_or_log)) return {run_or_log};
  throw InputError(run_or_log.string() + (fs::exists(run_or_log) ? ": neither a run folder nor a log"
                                                                 : ": no such run folder or log"));
}

}  // namespace evalbus::results
