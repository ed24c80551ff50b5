// Converts the result of an episode to a line of episodes.jsonl.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_summary_t.hpp"

namespace evalbus::results {

// Returns one line of episodes.jsonl. `begin`: EPISODE_BEGIN of an episode that evalbus simulated. If null,
// the start of the episode is unknown, and the line has no "parameters".
nlohmann::ordered_json EpisodeJson(const std::string& task, const std::string& variation,
                                   const episode_summary_t& summary, const episode_begin_t* begin = nullptr);

}  // namespace evalbus::results
