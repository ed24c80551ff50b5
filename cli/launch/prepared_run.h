// A run before its first episode: checked, resolved, with its folder and run.json.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bus/reserved_bus.h"
#include "cli/launch/run_controller.h"
#include "cli/launch/run_options.h"
#include "cli/results/run_folder.h"
#include "sim/prepared_scene.h"

namespace evalbus::launch {

struct PreparedRun {
  // Resolved: task, robot, run id, folder, models.
  RunOptions options;
  // Composed for all who work for the run; nothing for a worker.
  std::optional<sim::PreparedScene> scene;
  // What it is made of.
  nlohmann::ordered_json facts;
  results::RunFolder folder;
  RunPlan plan;
  // Lines of episodes.jsonl that were there before and stay, in order: invalid ones are run again.
  std::vector<nlohmann::ordered_json> finished;
  // Its bus, from Announce() on, or of a worker; none where everything is in one process.
  ReservedBus bus{};

  // How many episodes there are to be.
  int num_wanted() const { return static_cast<int>(finished.size() + plan.episodes.size()); }
  // run.json.
  nlohmann::ordered_json Json() const;
};

// Throws InputError: unknown names, cameras that are not there, a folder that is taken, or one of a run that
// was made otherwise or that no reader takes; nothing in it has been changed then.
PreparedRun PrepareRun(RunOptions options);

// The same for a worker of a run that another process has prepared, with its share of the episodes.
PreparedRun PrepareWorker(RunOptions options);

// Chooses the run's bus, says so, and writes the models and run.json. What summary.json says ends here.
void Announce(PreparedRun* run);

// Keys of run.json that identify the task, robot, models and software of a run.
nlohmann::ordered_json SceneFacts(const sim::PreparedScene& prepared);

// Throws InputError that names the option that is another one than in a file of before, which holds options.
void CheckFixedOptions(const std::filesystem::path& file, const nlohmann::ordered_json& before,
                       const RunOptions& options);

// "expert" of "expert", "replay" of "replay:runs/a", the name that was given; for names of folders.
std::string ShortPolicyName(const RunOptions& options);

}  // namespace evalbus::launch
