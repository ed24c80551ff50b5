// Generates one HTML page with the results of a plan: success rates by task and policy, differences, failure
// reasons. Equal input gives equal bytes.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "metrics/statistics/run_statistics.h"
#include "report/page/page.h"
#include "results/ranking.h"

namespace evalbus::report {

struct PlanCell {
  metrics::RunSummary summary{};
  std::string url{};  // report of the run; may be empty
  // Links to episodes in the 3D viewer, preferably to a failure; may be empty.
  std::vector<ReportLink> episodes{};
};

struct PlanRow {
  std::string name;
  std::vector<PlanCell> cells;  // one per policy
};

struct PlanVerdict {
  std::string policy;
  std::string text;
  // Difference from the baseline, for example "-47 points (-64 to -27)".
  std::string difference;
  // "better" or "worse"; empty if there is no significant difference.
  std::string judgment;
  std::string url;  // comparison page
};

struct PlanReport {
  std::string title;
  // Result of the plan, for example "a 90 %, b 56 %, c 52 %; b and c are worse than a".
  std::string verdict;
  std::vector<std::string> policies;
  std::string baseline;
  std::vector<PlanRow> tasks;
  // Row with the totals over all tasks.
  PlanRow all;
  // Mean of the tasks' success rates, per policy.
  std::vector<double> means;
  std::vector<PlanVerdict> verdicts;
  std::string verdict_note;
  // Policies by descending success; empty if there is no ranking.
  std::vector<results::RankedRun> ranking;
  // One map per policy, from a failure reason to the URL of an example episode in the 3D viewer. Some reasons
  // have no example.
  std::vector<std::map<std::string, std::string>> failed_episodes;
  std::vector<ReportLink> reports;  // one per policy
  std::vector<std::string> remarks;
};

std::string PlanPage(const PlanReport& report, const std::string& made_by);

}  // namespace evalbus::report
