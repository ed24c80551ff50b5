// Generates the scoreboard of `evalbus web`, the block "board" of docs/viewer_data.md. It contains the
// success rates by policy and task, differences from the baseline, and how far the episodes get. All
// statistics are computed by the library `results`.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::report {

// A run on the page, with its finished episodes.
struct BoardRun {
  // Index of the run among the page's runs.
  int number = 0;
  // Name of the policy; runs with equal names form one row of the board.
  std::string policy;
  // Folder on the command line that contains the run. A policy that was evaluated on one task in two such
  // folders has one row per folder.
  std::string source;
  bool is_over = false;
  // Number of episodes of the whole run according to its plan; 0 if not known. `run` may be a shard of it.
  int planned = 0;
  const results::RecordedRun* run = nullptr;
  // Names of the task's stages by index; some may be missing.
  std::map<int, std::string> stage_names{};
};

struct BoardFacts {
  // Name of the baseline that all other policies are compared with; empty: the first policy.
  std::string baseline;
  // True if the plan tests its results repeatedly while it runs. The p values of a single test are then not
  // valid.
  bool is_sequential = false;
  // Names of the policies and tasks of plans, including those whose runs have not begun.
  std::set<std::string> policies{}, tasks{};
  // Number of runs that have not begun, and the number of their episodes as far as known.
  int waiting_runs = 0, waiting_episodes = 0;
};

std::string BoardBlock(const std::vector<BoardRun>& runs, const BoardFacts& facts);

}  // namespace evalbus::report
