// Names in the folder of a run (docs/run_folder.md), which several processes write and read.
#pragma once

#include <charconv>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace evalbus {

// How the run was made, and its options; by this file a folder is known as a run's.
inline constexpr char kRunJson[] = "run.json";
// By this one as a suite's.
inline constexpr char kSuiteJson[] = "suite.json";
// A line for each finished episode.
inline constexpr char kEpisodesJsonl[] = "episodes.jsonl";
// Of a run, a suite, and of each episode once the launcher has counted it.
inline constexpr char kSummaryJson[] = "summary.json";

// Summary of a collection of demonstrations.
inline constexpr char kCollectJson[] = "collect.json";

// The composed scene.
inline constexpr char kModelFolder[] = "model";
inline constexpr char kPhysicsModel[] = "physics.mjb";
inline constexpr char kVisualModel[] = "visual.mjb";
inline constexpr char kSceneXml[] = "scene.xml";

inline constexpr char kEpisodesFolder[] = "episodes";
inline constexpr char kEventLog[] = "events.lcmlog";
// Behind the name of a log that zstd has packed (--log zstd).
inline constexpr char kPackedEnding[] = ".zst";
// Of an episode whose policy is behind a server.
inline constexpr char kPolicyCallsJson[] = "policy_calls.json";
// Behind the name of an episode's folder while its log is being written.
inline constexpr char kUnfinishedEnding[] = ".partial";

inline constexpr char kLogsFolder[] = "logs";

// What a run or a suite is called: by its folder, also as "x/" or ".".
inline std::string NameOfRun(const std::filesystem::path& folder) {
  const std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

// Behind the number of ten thousands: a folder of ten thousand episodes.
inline constexpr std::string_view kManyEnding = "xxxx";

// RUN/episodes/0007; from the ten thousandth on RUN/episodes/1xxxx/10007, so that no folder has more entries
// than shared file systems list in a moment.
inline std::filesystem::path EpisodeFolder(const std::filesystem::path& run, int episode) {
  constexpr int kMany = 10'000;
  char name[16];
  std::snprintf(name, sizeof name, "%04d", episode);
  const std::filesystem::path all = run / kEpisodesFolder;
  return episode < kMany ? all / name : all / (std::to_string(episode / kMany) += kManyEnding) / name;
}
inline std::filesystem::path UnfinishedEpisodeFolder(const std::filesystem::path& run, int episode) {
  return EpisodeFolder(run, episode).string() + kUnfinishedEnding;
}
// The log in an episode's folder, packed or not; where there is none, what a plain one would be called.
inline std::filesystem::path LogIn(const std::filesystem::path& episode_folder) {
  std::error_code ignored;
  const std::filesystem::path log = episode_folder / kEventLog, packed = log.string() + kPackedEnding;
  return std::filesystem::exists(packed, ignored) ? packed : log;
}
inline std::filesystem::path EpisodeLog(const std::filesystem::path& run, int episode) {
  return LogIn(EpisodeFolder(run, episode));
}
// The other way round, of a folder in episodes/, finished or not; nothing where it is no episode's.
inline std::optional<int> EpisodeOfFolder(const std::filesystem::path& folder) {
  const std::string name = folder.filename().string();
  unsigned episode = 0;
  const auto parsed = std::from_chars(name.data(), name.data() + name.size(), episode);
  const std::string_view rest(parsed.ptr, name.data() + name.size());
  if (parsed.ec != std::errc() || episode > std::numeric_limits<int>::max()) return std::nullopt;
  if (!rest.empty() && rest != kUnfinishedEnding) return std::nullopt;
  return static_cast<int>(episode);
}
// All of a run, finished or not, in no order. A folder that goes meanwhile is left out.
inline std::vector<std::filesystem::path> EpisodeFolders(const std::filesystem::path& run) {
  std::vector<std::filesystem::path> found, to_list = {run / kEpisodesFolder};
  while (!to_list.empty()) {
    std::error_code gone;
    auto entry = std::filesystem::directory_iterator(to_list.back(), gone);
    to_list.pop_back();
    for (; !gone && entry != std::filesystem::directory_iterator(); entry.increment(gone)) {
      if (EpisodeOfFolder(entry->path())) {
        found.push_back(entry->path());
      } else if (entry->path().filename().string().ends_with(kManyEnding)) {
        to_list.push_back(entry->path());
      }
    }
  }
  return found;
}
// The run of the log of an episode.
inline std::filesystem::path RunFolderOf(const std::filesystem::path& log) {
  std::filesystem::path all = std::filesystem::absolute(log).lexically_normal().parent_path().parent_path();
  if (all.filename().string().ends_with(kManyEnding)) all = all.parent_path();
  return all.parent_path();
}
inline bool IsUnfinished(const std::filesystem::path& episode_folder) {
  return episode_folder.extension() == kUnfinishedEnding;
}
// RUN/logs/sim.log
inline std::filesystem::path LogFile(const std::filesystem::path& run, const std::string& component) {
  return run / kLogsFolder / (component + ".log");
}

}  // namespace evalbus
