// Writes run folders for the tests of code that reads them.
#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "base/random.h"

namespace evalbus::results {

// Returns the seed of an episode of a run whose run.json has no seed_stream.
inline int64_t EpisodeSeed(int64_t run_seed, int episode) {
  return SeedSource{run_seed, kSharedSeeds, {}, {}}.OfEpisode(episode);
}

// Returns run.json of a run of lift_pot/position.
inline nlohmann::ordered_json RunInfo(int episodes, const std::string& policy = "expert") {
  return {{"run_id", "run"},      {"task", "lift_pot"}, {"variation", "position"}, {"policy", policy},
          {"episodes", episodes}, {"seed", 7},          {"control_hz", 50.0}};
}

// Returns a line of the run's episodes.jsonl.
inline nlohmann::ordered_json EpisodeLine(int episode, bool success = true,
                                          nlohmann::ordered_json metrics = nlohmann::ordered_json::object()) {
  metrics["success"] = success ? 1.0 : 0.0;
  if (!metrics.contains("completion_time")) metrics["completion_time"] = 4;
  return {{"task", "lift_pot"},
          {"variation", "position"},
          {"episode", episode},
          {"seed", EpisodeSeed(7, episode)},
          {"end_reason", success ? "success" : "time_limit"},
          {"end_detail", ""},
          {"failure_reason", success ? "" : "timeout"},
          {"complete", true},
          {"metrics", std::move(metrics)},
          {"extended", {{"missing_ticks", 0}}},
          {"explanation", {{"text", ""}}}};
}

inline void WriteFile(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

inline void WriteRun(const std::filesystem::path& folder, const nlohmann::ordered_json& info,
                     const std::vector<nlohmann::ordered_json>& episodes) {
  WriteFile(folder / "run.json", info.dump(2) + "\n");
  std::string lines;
  for (const auto& episode : episodes) lines += episode.dump() + "\n";
  if (!lines.empty()) WriteFile(folder / "episodes.jsonl", lines);
}

}  // namespace evalbus::results
