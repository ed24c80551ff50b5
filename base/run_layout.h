// Names in the folder of a run (docs/run_folder.md), which several processes write and read.
#pragma once

#include <array>
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

// Configuration and options of the run. A folder with this file is a run folder.
inline constexpr char kRunJson[] = "run.json";
// "schema_version" in run.json; it applies to all files of the run folder (docs/versioning.md).
inline constexpr int kRunSchemaVersion = 1;
// A folder with this file is the folder of a suite.
inline constexpr char kSuiteJson[] = "suite.json";
// One line for each finished episode.
inline constexpr char kEpisodesJsonl[] = "episodes.jsonl";
// Summary of a run or a suite, and of each episode that the launcher has counted.
inline constexpr char kSummaryJson[] = "summary.json";

// Summary of a collection of demonstrations.
inline constexpr char kCollectJson[] = "collect.json";

// Folder of a run with the composed scene: the compiled models and its XML text.
inline constexpr char kModelFolder[] = "model";
inline constexpr char kPhysicsModel[] = "physics.mjb";
inline constexpr char kVisualModel[] = "visual.mjb";
inline constexpr char kSceneXml[] = "scene.xml";
inline constexpr std::array kModelFiles{kPhysicsModel, kVisualModel, kSceneXml};

// Largest index of an episode.
inline constexpr int kMaxEpisode = 99'999'999;

inline constexpr char kEpisodesFolder[] = "episodes";
inline constexpr char kEventLog[] = "events.lcmlog";
// Suffix of a log that is compressed with zstd (--log zstd).
inline constexpr char kPackedEnding[] = ".zst";
// File with the calls to the policy's server in an episode.
inline constexpr char kPolicyCallsJson[] = "policy_calls.json";
// Suffix of an episode's folder while its log is being written.
inline constexpr char kUnfinishedEnding[] = ".partial";

inline constexpr char kLogsFolder[] = "logs";

// Returns the name of a run or a suite, which is the name of its folder, even if the folder is given as "x/"
// or ".".
inline std::string NameOfRun(const std::filesystem::path& folder) {
  const std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

// Suffix of the name of a folder with up to ten thousand episodes; the name begins with the episode number
// divided by 10,000.
inline constexpr std::string_view kManyEnding = "xxxx";

// Returns the folder of an episode: RUN/episodes/0007 or, for episodes with numbers of at least 10000,
// RUN/episodes/1xxxx/10007, because shared file systems list large folders slowly.
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
// Returns the log in an episode's folder, compressed or not. If there is none, returns the name of an
// uncompressed log.
inline std::filesystem::path LogIn(const std::filesystem::path& episode_folder) {
  std::error_code ignored;
  const std::filesystem::path log = episode_folder / kEventLog, packed = log.string() + kPackedEnding;
  return std::filesystem::exists(packed, ignored) ? packed : log;
}
inline std::filesystem::path EpisodeLog(const std::filesystem::path& run, int episode) {
  return LogIn(EpisodeFolder(run, episode));
}
// Returns the index of the episode in a folder, which may be unfinished; nullopt if it is not an episode's
// folder.
inline std::optional<int> EpisodeOfFolder(const std::filesystem::path& folder) {
  const std::string name = folder.filename().string();
  unsigned episode = 0;
  const auto parsed = std::from_chars(name.data(), name.data() + name.size(), episode);
  const std::string_view rest(parsed.ptr, name.data() + name.size());
  if (parsed.ec != std::errc() || episode > std::numeric_limits<int>::max()) return std::nullopt;
  if (!rest.empty() && rest != kUnfinishedEnding) return std::nullopt;
  return static_cast<int>(episode);
}
// Returns all episode folders of a run, finished or not, in arbitrary order. Folders that are removed during
// the call are omitted.
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
// Returns the run folder of an episode's log.
inline std::filesystem::path RunFolderOf(const std::filesystem::path& log) {
  std::filesystem::path all = std::filesystem::absolute(log).lexically_normal().parent_path().parent_path();
  if (all.filename().string().ends_with(kManyEnding)) all = all.parent_path();
  return all.parent_path();
}
inline bool IsUnfinished(const std::filesystem::path& episode_folder) {
  return episode_folder.extension() == kUnfinishedEnding;
}
// Returns the path of a component's log file: RUN/logs/sim.log.
inline std::filesystem::path LogFile(const std::filesystem::path& run, const std::string& component) {
  return run / kLogsFolder / (component + ".log");
}

}  // namespace evalbus
