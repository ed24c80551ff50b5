// Names in the folder of a run (docs/run_folder.md), which several processes write and read.
#pragma once

#include <charconv>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace evalbus {

// How the run was made, and its options; by this file a folder is known as a run's.
inline constexpr char kRunJson[] = "run.json";
// By this one as a suite's.
inline constexpr char kSuiteJson[] = "suite.json";
// A line for each finished episode.
inline constexpr char kEpisodesJsonl[] = "episodes.jsonl";
// Of a run, a suite, and of each episode once the launcher has counted it.
inline constexpr char kSummaryJson[] = "summary.json";

// The composed scene.
inline constexpr char kModelFolder[] = "model";
inline constexpr char kPhysicsModel[] = "physics.mjb";
inline constexpr char kVisualModel[] = "visual.mjb";
inline constexpr char kSceneXml[] = "scene.xml";

inline constexpr char kEpisodesFolder[] = "episodes";
inline constexpr char kEventLog[] = "events.lcmlog";
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

// RUN/episodes/0007
inline std::filesystem::path EpisodeFolder(const std::filesystem::path& run, int episode) {
  char name[16];
  std::snprintf(name, sizeof name, "%04d", episode);
  return run / kEpisodesFolder / name;
}
inline std::filesystem::path UnfinishedEpisodeFolder(const std::filesystem::path& run, int episode) {
  return EpisodeFolder(run, episode).string() + kUnfinishedEnding;
}
inline std::filesystem::path EpisodeLog(const std::filesystem::path& run, int episode) {
  return EpisodeFolder(run, episode) / kEventLog;
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
inline bool IsUnfinished(const std::filesystem::path& episode_folder) {
  return episode_folder.extension() == kUnfinishedEnding;
}
// RUN/logs/sim.log
inline std::filesystem::path LogFile(const std::filesystem::path& run, const std::string& component) {
  return run / kLogsFolder / (component + ".log");
}

}  // namespace evalbus
