// Runs a whole plan on this machine.
#pragma once

#include <string>
#include <vector>

#include "plans/plan_folder.h"

namespace evalbus::plans {

// State of a policy's sequential comparison with the baseline; is_decided if it ended before the last
// episode.
struct Stop {
  std::string policy;
  // Episodes per task.
  int episodes = 0;
  // Pairs in which only the policy, and only the baseline, succeeded. The p values are the smallest of all
  // looks.
  int only_policy = 0, only_baseline = 0;
  double p = 1, p_adjusted = 1;
  bool is_decided = false;
  // For example "after 40 episodes of each task: better than expert, ...".
  std::string Text(const std::string& baseline, const Until& until) const;
};

// Runs the missing episodes, at most `workers` runs at a time, then calls FinishPlan(). Throws InputError,
// EnvironmentError.
void RunPlan(const PlanFolder& folder, int workers);

// Runs the missing episodes of a plan without Plan::until, at most `workers` runs at a time. Throws
// InputError, EnvironmentError.
void RunAllEpisodes(const PlanFolder& folder, int workers);

// Completes a plan whose runs are all there, for example after a merge: records the videos, writes the pages,
// and prints the comparisons to stdout.
void FinishPlan(const PlanFolder& folder, int workers);

}  // namespace evalbus::plans
