// Names in the folder of a run (docs/run_folder.md), which several processes write and read.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

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
// Behind the name of an episode's folder while its log is being written.
inline constexpr char kUnfinishedEnding[] = ".partial";
// Behind a film's name while it is being written.
inline constexpr char kUnfinishedFilmEnding[] = ".partial.mp4";

inline constexpr char kLogsFolder[] = "logs";

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
// RUN/logs/sim.log
inline std::filesystem::path LogFile(const std::filesystem::path& run, const std::string& component) {
  return run / kLogsFolder / (component + ".log");
}

}  // namespace evalbus
