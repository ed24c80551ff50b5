// The scoreboard of `evalbus web`: policies by tasks with success rates, differences from the baseline, and
// how far the episodes get, as the block "board" of docs/viewer_data.md. Pure; all statistics are those of
// `results`.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::report {

// A run on the page, with its episodes so far.
struct BoardRun {
  // Index among the page's runs.
  int number = 0;
  // Name of the policy; runs with equal names form one row of the board.
  std::string policy;
  // The folder that the user named and that contains the run. If a policy has evaluated a task in two of
  // them, each folder gets its own row.
  std::string source;
  bool is_over = false;
  // Number of episodes of the whole run according to its plan, of which `run` may be a shard; 0 if not known.
  int planned = 0;
  const results::RecordedRun* run = nullptr;
  // Names of the task's stages by index; some may be missing.
  std::map<int, std::string> stage_names{};
};

struct BoardFacts {
  // Name of the policy that others are compared with; empty: the first.
  std::string baseline;
  // The plan tests its results while it runs, so that p values of a single test are not valid.
  bool is_sequential = false;
  // Runs that have not begun, and the number of their episodes as far as known.
  int waiting_runs = 0, waiting_episodes = 0;
};

std::string BoardBlock(const std::vector<BoardRun>& runs, const BoardFacts& facts);

}  // namespace evalbus::report
