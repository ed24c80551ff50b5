// A run before its first episode: checked, resolved, with its folder and run.json.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/launch/run_controller.h"
#include "cli/launch/run_options.h"
#include "cli/results/run_folder.h"

namespace evalbus::launch {

struct PreparedRun {
  // Resolved: task, robot, run id, folder.
  RunOptions options;
  results::RunFolder folder;
  RunPlan plan;
  // Lines of episodes.jsonl that were there before, in order.
  std::vector<nlohmann::ordered_json> finished;
  // The folders that were made for it.
  std::vector<std::filesystem::path> made;

  // How many episodes there are to be.
  int num_wanted() const { return static_cast<int>(finished.size() + plan.episodes.size()); }
  // Takes the folder away again, unless an episode was finished: what has none is not a run.
  void Undo() const;
};

// Throws InputError: unknown names, cameras that are not there, a folder that is taken, or one of a run that
// was made otherwise.
PreparedRun PrepareRun(RunOptions options);

// The same for a worker of a run that another process has prepared, with its share of the episodes.
PreparedRun PrepareWorker(RunOptions options);

// Chooses the run's bus, says so, and writes run.json.
void Announce(PreparedRun* run);

// How the run is made: facts, and all its options.
nlohmann::ordered_json RunJson(const RunOptions& options);

// "expert" of "expert", "replay" of "replay:runs/a"; for names of folders.
std::string ShortPolicyName(const RunOptions& options);

}  // namespace evalbus::launch
