// Prepares a run before its first episode: checks and resolves the options, and prepares folder and run.json.
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
  // Options with the resolved task, robot, run id, folder and models.
  RunOptions options;
  // The composed scene for all processes of the run; nullopt in a worker.
  std::optional<sim::PreparedScene> scene;
  // Result of RunFacts() and facts about training sets and the renderer; in a worker, the contents of
  // run.json.
  nlohmann::ordered_json facts;
  results::RunFolder folder;
  RunPlan plan;
  // Lines of episodes.jsonl that are kept when resuming, in order. Lines of invalid episodes are kept only if
  // --only excludes them, because all other invalid episodes are run again. Empty in a worker.
  std::vector<nlohmann::ordered_json> finished;
  // Episodes of the whole run, as "only" in run.json: the episodes of --only and, when resuming, of earlier
  // calls. Empty if all episodes are planned. Not set in a worker.
  std::vector<int> planned_only = {};
  // The run's bus. Announce() sets it; in a worker, it is already set. Not set if all components are in one
  // process, or if there are several workers, which have their own buses.
  ReservedBus bus{};

  // Returns the total number of episodes, including finished ones. Must not be called in a worker.
  int num_wanted() const { return static_cast<int>(finished.size() + plan.episodes.size()); }
};

// Throws InputError for unknown names, missing cameras, or a folder that is in use, is invalid, or contains a
// run with different options. The folder is not changed in these cases.
PreparedRun PrepareRun(RunOptions options);

// Prepares a worker's share of the episodes of a run that another process has prepared.
PreparedRun PrepareWorker(RunOptions options);

// Chooses the run's bus, unless there are several workers; prints it unless options.url selects it. Writes
// the models and run.json. Removes summary.json if there are episodes to run.
void Announce(PreparedRun* run);

// Throws an InputError that names the option if a fixed option differs from its value in `file`. before:
// contents of `file`.
void CheckFixedOptions(const std::filesystem::path& file, const nlohmann::ordered_json& before,
                       const RunOptions& options);

// Returns the policy's name for folder names: policy_name if it is set; otherwise --policy up to the first
// colon, for example "replay" for "replay:runs/a". Slashes are replaced by dashes.
std::string ShortPolicyName(const RunOptions& options);

}  // namespace evalbus::runner
