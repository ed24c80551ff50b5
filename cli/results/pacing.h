// How well a realtime run kept time: beside its scores and apart from them, since no two runs agree.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "evalbus/episode_end_t.hpp"

namespace evalbus::results {

// What of a run's times is told as a distribution (time_distribution_t), and its name for people.
struct PacingTimes {
  const char* key;
  const char* name;
};
inline constexpr PacingTimes kPacingTimes[] = {{"error", "STATE behind the clock"},
                                               {"action_latency", "STATE to ACTION"},
                                               {"partial_latency", "STATE to score"}};

// For the key "pacing" of an episode's line (docs/run_folder.md).
nlohmann::ordered_json EpisodePacing(const episode_end_t& end, int64_t deadline_misses);

// For the key "pacing" of summary.json: counts are sums, times are the largest of any episode.
// null where an episode has none.
nlohmann::ordered_json RunPacing(const std::vector<nlohmann::ordered_json>& episodes);

// What happened to its ticks, as a sentence; that and its times as some lines for people.
std::string PacingSentence(const nlohmann::ordered_json& run_pacing);
std::string PacingText(const nlohmann::ordered_json& run_pacing);

}  // namespace evalbus::results
