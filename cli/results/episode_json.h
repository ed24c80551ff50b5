// The result of an episode, as its line of episodes.jsonl has it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_summary_t.hpp"

namespace evalbus::results {

// One line of episodes.jsonl. begin: EPISODE_BEGIN of an episode that evalbus simulates; null where its start
// is not known, and the line has no "parameters".
nlohmann::ordered_json EpisodeJson(const std::string& task, const std::string& variation,
                                   const episode_summary_t& summary, const episode_begin_t* begin = nullptr);

}  // namespace evalbus::results
