// A whole plan on this machine.
#pragma once

#include <string>
#include <vector>

#include "cli/plans/plan_folder.h"

namespace evalbus::plans {

// Where a policy's comparison with the baseline ended before the plan's last episode, or did not.
struct Stop {
  std::string policy;
  // Of each task.
  int episodes = 0;
  // Pairs in which only the policy, and only the baseline, succeeded; the smallest p of all looks.
  int only_policy = 0, only_baseline = 0;
  double p = 1, p_adjusted = 1;
  bool is_decided = false;
  // "after 40 episodes of each task: better than expert, ..."
  std::string Text(const std::string& baseline, const Until& until) const;
};

// Runs what is missing, so many runs at a time, videos and reports. Throws InputError, EnvironmentError.
void RunPlan(const PlanFolder& folder, int workers);

// What comes after all runs are there, also by a merge: videos, plan_summary.json, the tables on stdout.
void FinishPlan(const PlanFolder& folder, int workers);

}  // namespace evalbus::plans
