// Pacing of real-time runs. Reported separately from the scores, because it differs between identical runs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "evalbus/episode_end_t.hpp"
#include "results/run_reader.h"

namespace evalbus::results {

// A time that is reported as a distribution (time_distribution_t), with its JSON key and display name.
struct PacingTimes {
  const char* key;
  const char* name;
};
inline constexpr PacingTimes kPacingTimes[] = {{"error", "STATE behind the clock"},
                                               {"action_latency", "STATE to ACTION"},
                                               {"partial_latency", "STATE to score"}};

// Returns the value of the key "pacing" in an episode's line (docs/run_folder.md).
nlohmann::ordered_json EpisodePacing(const episode_end_t& end, int64_t deadline_misses);

// Returns the value of the key "pacing" in summary.json. Counts are sums over the episodes, and times are
// maxima. Null if this is not a real-time run, if there is no episode, or if an episode has no pacing.
nlohmann::ordered_json RunPacing(const RecordedRun& run);

// PacingSentence() summarizes the ticks in a sentence. PacingText() adds the times, as several lines.
std::string PacingSentence(const nlohmann::ordered_json& run_pacing);
std::string PacingText(const nlohmann::ordered_json& run_pacing);

}  // namespace evalbus::results
