// The result of an episode, as its line of episodes.jsonl has it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "evalbus/episode_summary_t.hpp"

namespace evalbus::results {

// One line of episodes.jsonl.
nlohmann::ordered_json EpisodeJson(const std::string& task, const std::string& variation,
                                   const episode_summary_t& summary);

}  // namespace evalbus::results
