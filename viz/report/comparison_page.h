// Comparisons of runs with a baseline as one HTML page that opens without a network. Pure; equal input, equal
// bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "viz/report/page.h"

namespace evalbus::viz {

// A value of a run and of the baseline; NaN where there is none.
struct ReportDifference {
  std::string name;  // "completion time"
  std::string unit;
  double baseline = 0, run = 0;
  // run - baseline, with its 95 % interval.
  double difference = 0, lower = 0, upper = 0;
  double p = 0;
  double p_holm = 0;
  // What it comes to: "better", "worse", "differs"; empty: nothing.
  std::string judgment;
};

// A pair of episodes that only one of the two succeeded in.
struct ReportFlip {
  int64_t seed = 0;
  // Why it did not succeed; empty of the one that did.
  std::string baseline, run;
  int baseline_episode = 0, run_episode = 0;
  std::vector<ReportLink> baseline_videos, run_videos;
};

struct ReportTaskComparison {
  std::string task;  // "lift_pot/position"
  // In shares; over how many episodes, and of which kind, `counts` says.
  ReportDifference success;
  std::string counts;
  std::vector<ReportDifference> metrics;
  std::vector<ReportFlip> flips;
  // Where flips have no videos: how they are made; a sentence.
  std::string video_hint;
};

struct ReportComparison {
  std::string run, baseline;  // names, with policies
  std::string verdict;        // a sentence or two
  std::vector<ReportTaskComparison> tasks;
  // Over all tasks, where there are several.
  ReportDifference success;
  // How the numbers are made, and what is left out.
  std::vector<std::string> notes;
};

// viewer: nothing for none.
std::string ComparisonPage(const std::string& title, const std::vector<ReportComparison>& comparisons,
                           const std::string& made_by, const std::optional<PackedViewer>& viewer);

}  // namespace evalbus::viz
