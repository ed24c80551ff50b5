// Generates the pages of a plan's results: an overview, and a page for each comparison.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "plans/plan_folder.h"
#include "report/comparison_tables.h"
#include "results/comparison.h"
#include "results/ranking.h"

namespace evalbus::plans {

struct PlanResults {
  // One suite per policy, in the plan's order and with the plan's names.
  std::vector<results::RecordedRuns> suites;
  // Comparison of every policy with the baseline. p values are adjusted for the number of policies. With
  // Plan::until (but without `width`), p of success is anytime-valid; p of metrics assumes a single test.
  std::vector<results::Comparison> comparisons;
  // The decision of each comparison (Stop::Text). Empty without Plan::until, with its `width`, and before the
  // plan has stopped.
  std::vector<std::string> stops;
  // Ranking of the policies. Empty for fewer than three policies. Also empty with Plan::until, because the
  // policies then have different numbers of episodes, which depend on their results.
  std::vector<results::RankedRun> ranking;
};

// Reads the results of a plan. Throws InputError if a policy has no finished episode.
PlanResults ReadPlanResults(const PlanFolder& folder);

// Returns the success rates with their 95 % intervals: one column per policy, one row per task, and one row
// over all tasks if there are several.
report::TextTable RateTable(const PlanResults& results);

// Returns the pages that WritePlanPages() writes, by file. most: maximum size in bytes of a comparison page
// with its episodes for 3D playback; 0: no 3D playback.
std::map<std::filesystem::path, std::string> PlanPages(const PlanFolder& folder, const PlanResults& results,
                                                       size_t most);

// Writes FOLDER/report.html and the comparison pages POLICY/against_BASELINE.html. report.html links to the
// policies' reports (POLICY/report.html), even if these do not exist yet.
void WritePlanPages(const PlanFolder& folder, const PlanResults& results);

}  // namespace evalbus::plans
