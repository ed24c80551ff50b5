// Finds the run folders in a folder that a user names: a run, a suite, or the results of a plan.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace evalbus::results {

struct FoundRun {
  std::filesystem::path folder;
  // Name of the policy in its plan; empty if the run belongs to no plan.
  std::string policy;
  // Display name: the folder's name, for example "lift_pot-position"; SUITE/RUN for a run of a suite;
  // POLICY/RUN for a run of a plan, for example "expert/lift_pot-position"; for a plan shard, the name of its
  // folder.
  std::string name;
  // Number of episodes of the whole run according to its plan; 0 if the run belongs to no plan.
  int planned = 0;
};

struct FoundRuns {
  // Runs in the order of the plan or suite. A run of a plan that has no folder POLICY/TASK yet is replaced by
  // its finished shards or, if it has none, is included with the folder that it will have.
  std::vector<FoundRun> runs;
  // Names of the plan's policies and tasks; empty if there is no plan.
  std::vector<std::string> policies, tasks;
  // Name of the plan's baseline; empty if there is no plan.
  std::string baseline;
  // True for a plan with `until`, which stops depending on its results. Tests of its success rates that
  // assume a fixed number of episodes are then not valid.
  bool is_sequential = false;
};

// Returns whether the folder contains a run, a suite or a plan, which need not have finished.
bool IsEvaluation(const std::filesystem::path& folder);

// Returns "; did you mean 'runs/late'?" if a run, suite or plan next to this missing folder has a similar
// name; otherwise an empty text.
std::string SimilarFolder(const std::filesystem::path& missing);

// Returns the runs in a folder. Throws InputError if the folder does not exist, or if suite.json or plan.json
// cannot be read.
FoundRuns FindRuns(const std::filesystem::path& folder);

}  // namespace evalbus::results
