// Generates the contents of run.json (docs/run_folder.md), which describe the configuration of a run.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runner/run_options.h"
#include "sim/prepared_scene.h"

namespace evalbus::runner {

// Returns the facts about task, robot, models, software and policy contract, from the current files.
nlohmann::ordered_json RunFacts(const sim::PreparedScene& prepared, const RunOptions& options);

// Returns run.json of a simulated run.
nlohmann::ordered_json RunJson(const nlohmann::ordered_json& facts, const RunOptions& options);

// Returns run.json of scored trajectories. map: file that assigns columns to joints. data: file or folder
// that the user named. files: the trajectories, one per episode.
nlohmann::ordered_json ScoredRunJson(const sim::PreparedScene& prepared, const std::filesystem::path& map,
                                     const std::filesystem::path& data,
                                     const std::vector<std::filesystem::path>& files);

// Returns the `evalbus run` command that repeats the run of a run.json. It contains the task, the policy,
// --episodes, --seed, and the options that differ from their defaults, except the options for bus, processes,
// workers and logs. Empty for a run that was not simulated.
std::string CommandOf(const nlohmann::ordered_json& run_json);

}  // namespace evalbus::runner
