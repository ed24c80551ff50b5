// The results of a plan as one HTML page: policies by tasks, what they differ in, why they fail. Pure; equal
// input, equal bytes.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "viz/report/page.h"

namespace evalbus::viz {

struct PlanCell {
  // complete: with a verdict.
  int successes = 0, complete = 0;
  // Of the success rate, in shares.
  double lower = 0, upper = 0;
  std::string url;  // of its run's report; may be empty
  // An episode of it in 3D, a failure where there is one; may be none.
  std::vector<ReportLink> episodes;
};

struct PlanRow {
  std::string name;
  std::vector<PlanCell> cells;  // by policy
};

struct PlanVerdict {
  std::string policy;
  std::string text;
  // Adjusted, as verdict_note says.
  double p = 1;
  // "better", "worse", "differs"; empty: nothing is shown.
  std::string judgment;
  std::string url;  // of the comparison's page
};

struct PlanRank {
  std::string policy;
  int successes = 0, episodes = 0;
  // Two that share one are not shown to differ.
  std::string letters;
};

struct PlanReport {
  std::string title;
  std::vector<std::string> policies;
  std::string baseline;
  std::vector<PlanRow> tasks;
  // Over all tasks; not where there is one.
  PlanRow all;
  // By policy, of all tasks: mean of their rates.
  std::vector<double> means;
  std::vector<PlanVerdict> verdicts;
  std::string verdict_note;
  // Most successful first; empty: none.
  std::vector<PlanRank> ranking;
  std::string ranking_note;
  // By policy: reasons with how many episodes failed for them.
  std::vector<std::vector<std::pair<std::string, int>>> failure_reasons;
  // By policy: of a reason the address of an episode in 3D that failed for it; not of every one.
  std::vector<std::map<std::string, std::string>> failed_episodes;
  std::vector<ReportLink> reports;  // of each policy
  std::vector<std::string> remarks;
};

std::string PlanPage(const PlanReport& report, const std::string& made_by);

}  // namespace evalbus::viz
