// The results of a plan as pages: one over all, one for each comparison; all from the same numbers.
#pragma once

#include <string>
#include <vector>

#include "cli/plans/plan_folder.h"
#include "cli/results/comparison.h"
#include "cli/results/ranking.h"

namespace evalbus::plans {

struct PlanResults {
  // By policy, in the plan's order; named as the plan names them.
  std::vector<results::RecordedRuns> suites;
  // Comparison of each other policy with the baseline. p values are adjusted for the policies, and hold at
  // any look where the plan stops when decided.
  std::vector<results::Comparison> comparisons;
  // The plan's verdict of each comparison when it stopped (Stop::Text); none for a plan that does not stop.
  std::vector<std::string> stops;
  // Empty for a plan that stops when decided: its policies have been run in different numbers of episodes,
  // which depend on their results.
  std::vector<results::RankedRun> ranking;
};

// Throws InputError where a policy has no finished episode.
PlanResults ReadPlanResults(const PlanFolder& folder);

// Writes FOLDER/report.html and the page of each comparison, POLICY/against_BASELINE.html. The first links
// the pages of policies (POLICY/report.html), whether they are there yet or not.
void WritePlanPages(const PlanFolder& folder, const PlanResults& results);

}  // namespace evalbus::plans
