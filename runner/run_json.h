// The contents of run.json (docs/run_folder.md): how a run was made.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runner/run_options.h"
#include "sim/prepared_scene.h"

namespace evalbus::runner {

// Task, robot, models, software and policy contract, as their files are now.
nlohmann::ordered_json RunFacts(const sim::PreparedScene& prepared, const RunOptions& options);

// run.json of a simulated run.
nlohmann::ordered_json RunJson(const nlohmann::ordered_json& facts, const RunOptions& options);

// run.json of scored trajectories. map: file that assigns columns to joints. data: file or folder that the
// user named. files: the trajectories, one per episode.
nlohmann::ordered_json ScoredRunJson(const sim::PreparedScene& prepared, const std::filesystem::path& map,
                                     const std::filesystem::path& data,
                                     const std::vector<std::filesystem::path>& files);

// Returns the `evalbus run` command with the options of a run.json that are not the default and that its
// results may depend on; empty for a run that nothing simulated.
std::string CommandOf(const nlohmann::ordered_json& run_json);

}  // namespace evalbus::runner
