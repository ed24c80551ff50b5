// Comparisons of runs with a baseline as one HTML page that works offline. Pure: equal input gives equal
// bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "report/page/page.h"

namespace evalbus::report {

// A value of a run and of the baseline; NaN if unavailable.
struct ReportDifference {
  std::string name;  // "completion time"
  std::string unit;
  double baseline = 0, run = 0;
  // run - baseline, with its 95 % confidence interval.
  double difference = 0, lower = 0, upper = 0;
  double p = 0;
  double p_holm = 0;
  // Conclusion: "better", "worse" or "differs"; empty: no significant difference.
  std::string judgment;
};

// A pair of episodes of which only one succeeded.
struct ReportFlip {
  int64_t seed = 0;
  // Failure reason; empty for the episode that succeeded.
  std::string baseline, run;
  int baseline_episode = 0, run_episode = 0;
  std::vector<ReportLink> baseline_videos, run_videos;
};

struct ReportTaskComparison {
  std::string task;  // "lift_pot/position"
  // Success rates as shares from 0 to 1; `counts` states the number and kind of episodes.
  ReportDifference success;
  std::string counts;
  std::vector<ReportDifference> metrics;
  std::vector<ReportFlip> flips;
  // If flips have no videos: a sentence that explains how to record them.
  std::string video_hint;
};

struct ReportComparison {
  std::string run, baseline;  // names, with policies
  std::string verdict;        // a sentence or two
  std::vector<ReportTaskComparison> tasks;
  // Over all tasks, if there are several.
  ReportDifference success;
  // Methods, and data that was left out.
  std::vector<std::string> notes;
};

// viewer: nothing if the page has no 3D viewer.
std::string ComparisonPage(const std::string& title, const std::vector<ReportComparison>& comparisons,
                           const std::string& made_by, const std::optional<viz::PackedViewer>& viewer);

}  // namespace evalbus::report
