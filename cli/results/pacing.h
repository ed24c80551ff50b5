// How well a realtime run kept time: beside its scores and apart from them, since no two runs agree.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "evalbus/episode_end_t.hpp"

namespace evalbus::results {

// For the key "pacing" of an episode's line (docs/run_folder.md).
nlohmann::ordered_json EpisodePacing(const episode_end_t& end, int64_t deadline_misses);

// For the key "pacing" of summary.json: counts are sums, errors are the largest of any episode. null where an
// episode has none.
nlohmann::ordered_json RunPacing(const std::vector<nlohmann::ordered_json>& episodes);

// One line for people.
std::string PacingText(const nlohmann::ordered_json& run_pacing);

}  // namespace evalbus::results
