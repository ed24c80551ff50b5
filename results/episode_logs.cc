#include "results/episode_logs.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "base/errors.h"
#include "base/plan_layout.h"
#include "base/run_layout.h"
#include "base/text.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;

// Returns the numbers of the finished episodes that have logs. Excludes folders such as 0007.partial.
std::vector<int> FinishedEpisodes(const fs::path& run) {
  std::vector<int> episodes;
  for (const fs::path& episode : EpisodeFolders(run)) {
    if (!IsUnfinished(episode) && fs::exists(LogIn(episode))) {
      episodes.push_back(*EpisodeOfFolder(episode));
    }
  }
  std::sort(episodes.begin(), episodes.end());
  return episodes;
}

std::vector<fs::path> LogsOfRun(const fs::path& run, const std::vector<int>& wanted) {
  const std::vector<int> finished = FinishedEpisodes(run);
  if (finished.empty()) throw InputError(run.string() + ": this run has no finished episode");
  for (const int episode : wanted) {
    if (std::ranges::binary_search(finished, episode)) continue;
    throw InputError(fmt::format("{} has no finished episode {}; it has {}: {}", run.string(), episode,
                                 Plural(static_cast<int64_t>(finished.size()), "episode"),
                                 RangesText(finished)));
  }
  std::vector<fs::path> logs;
  for (const int i : wanted.empty() ? finished : wanted) logs.push_back(EpisodeLog(run, i));
  return logs;
}

}  // namespace

std::vector<fs::path> EpisodeLogs(const fs::path& recording, const std::vector<int>& episodes) {
  if (fs::exists(recording / kSuiteJson)) {
    std::vector<fs::path> logs;
    for (const std::string& name : RunsInSuite(recording)) {
      if (FinishedEpisodes(recording / name).empty()) continue;
      std::ranges::copy(LogsOfRun(recording / name, episodes), std::back_inserter(logs));
    }
    if (logs.empty()) throw InputError(recording.string() + ": this suite has no finished episode");
    return logs;
  }
  if (fs::is_directory(recording / kEpisodesFolder)) return LogsOfRun(recording, episodes);
  if (const fs::path log = LogIn(recording); fs::exists(log)) return {log};
  if (fs::is_regular_file(recording)) return {recording};
  if (fs::exists(recording / kPlanJson))
    throw InputError(recording.string() + ": " + PlanNotExpected(recording, true));
  throw InputError(recording.string() + (fs::exists(recording) ? ": neither a run, a suite nor a log"
                                                               : ": no such run, suite or log"));
}

void CheckHasEpisodes(const fs::path& recording, const std::vector<int>& episodes) {
  if (episodes.empty() || fs::is_directory(recording / kEpisodesFolder) ||
      fs::exists(recording / kSuiteJson) || !fs::exists(recording))
    return;
  throw InputError("--episode: " + recording.string() + " is not a run folder; a log is used as a whole");
}

std::optional<RecordedRun> RunOf(const fs::path& log) {
  const fs::path run = RunFolderOf(log);
  if (!fs::absolute(log).lexically_normal().string().starts_with((run / kEpisodesFolder / "").string())) {
    return {};
  }
  if (!fs::exists(run / kRunJson)) return {};
  return ReadRunInfo(run);
}

}  // namespace evalbus::results
