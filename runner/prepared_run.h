// A run before its first episode: options checked and resolved, folder and run.json prepared.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bus/reserved_bus.h"
#include "results/run_folder.h"
#include "runner/run_controller.h"
#include "runner/run_options.h"
#include "sim/prepared_scene.h"

namespace evalbus::runner {

struct PreparedRun {
  // Resolved: task, robot, run id, folder, models.
  RunOptions options;
  // The composed scene, which all processes of the run use; nullopt in a worker.
  std::optional<sim::PreparedScene> scene;
  // RunFacts().
  nlohmann::ordered_json facts;
  results::RunFolder folder;
  RunPlan plan;
  // Lines of episodes.jsonl that are kept when resuming, in order; invalid episodes are run again.
  std::vector<nlohmann::ordered_json> finished;
  // The run's bus, set by Announce(), or earlier in a worker; none if everything is in one process.
  ReservedBus bus{};

  // Total number of episodes, including finished ones.
  int num_wanted() const { return static_cast<int>(finished.size() + plan.episodes.size()); }
};

// Throws InputError for unknown names, missing cameras, or a folder that is in use, is invalid, or contains a
// run with other options. The folder is not changed in these cases.
PreparedRun PrepareRun(RunOptions options);

// Prepares a worker's share of the episodes of a run that another process has prepared.
PreparedRun PrepareWorker(RunOptions options);

// Chooses the run's bus and prints it, and writes the models and run.json. Removes summary.json if episodes
// are missing.
void Announce(PreparedRun* run);

// Throws InputError that names the option if a fixed option differs from its value in `file`, whose contents
// are `before`.
void CheckFixedOptions(const std::filesystem::path& file, const nlohmann::ordered_json& before,
                       const RunOptions& options);

// Policy name for names of folders: "expert" for "expert", "replay" for "replay:runs/a", or policy_name if
// given.
std::string ShortPolicyName(const RunOptions& options);

}  // namespace evalbus::runner
