// Finds the run folders in a folder that a user names: a run, a suite, or the results of a plan.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace evalbus::results {

struct FoundRun {
  std::filesystem::path folder;
  // Name of the policy in its plan; empty outside a plan.
  std::string policy;
  // For example "lift_pot-position" or "expert/lift_pot-position", relative to the folder that was searched;
  // the folder's name for a run alone.
  std::string name;
  // Number of episodes of the whole run according to its plan; 0 outside a plan.
  int planned = 0;
};

struct FoundRuns {
  // In the order of the plan or suite. Runs that have not begun are included only if their folder would be
  // POLICY/TASK; while other machines evaluate parts of a plan, the finished shards of a run take its place.
  std::vector<FoundRun> runs;
  // Name of the plan's baseline; empty outside a plan.
  std::string baseline;
  // The plan stops when its comparisons are decided, so that other tests of its success rates are not valid.
  bool is_sequential = false;
};

// Whether the folder is a run, a suite or a plan's folder, finished or not.
bool IsEvaluation(const std::filesystem::path& folder);

// Throws InputError if suite.json or plan.json cannot be read.
FoundRuns FindRuns(const std::filesystem::path& folder);

}  // namespace evalbus::results
