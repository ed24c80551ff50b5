// The report of one or several runs as one HTML page that works offline. Pure: converts the structs below to
// text; equal input gives equal bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "report/page/figures.h"
#include "report/page/page.h"

namespace evalbus::report {

struct ReportEpisode {
  int episode = 0;
  int64_t seed = 0;
  std::string end_reason;
  std::string failure_reason;  // empty on success
  std::string explanation;     // a sentence; may be empty
  bool complete = true;
  bool success = false;
  // Metrics by their names in summary.json. The names must outlive this object.
  std::vector<std::pair<std::string_view, double>> values;
  std::vector<ReportLink> videos;
  std::vector<ReportLink> logs;
};

// A statistic of a metric's distribution, by its name in summary.json; two values are an interval.
struct ReportStatistic {
  std::string name;
  std::vector<double> value;
};

struct ReportMetric {
  std::string name;
  std::vector<ReportStatistic> statistics;
};

struct ReportInterval {
  std::string method;  // "Wilson"
  double lower, upper;
};

struct ReportStage {
  std::string index;
  std::string name;  // may be empty
  // Number of complete episodes that reached the stage, and the median time at which they did, s; NaN if none
  // did.
  int reached = 0;
  double median_time = 0;
};

// Percentiles of a time, s.
struct ReportTimes {
  std::string name;
  double p50, p99, p999, max;
};

using ReportCounts = std::vector<std::pair<std::string, int64_t>>;

// Curves and events of one episode.
struct ReportCurves {
  int episode = 0;
  std::string why;  // reason for the selection: "first failure"
  std::vector<CurveFigure> figures;
  std::vector<EpisodeEvent> events;
};

struct ReportRun {
  std::string name;
  std::string task;
  std::string variation;
  std::string policy;
  // Numbers of finished episodes, of complete ones, and of successes among the complete ones.
  int episodes = 0, complete = 0, successes = 0;
  // Complete episodes whose success could not be determined; not included in the success rate.
  int not_judged = 0;
  // 95 % intervals; the first one is shown in figures and text.
  std::vector<ReportInterval> intervals;
  // Caveats that are shown above the numbers, one sentence each.
  std::vector<std::string> remarks;
  // How the policy was run, one sentence each.
  std::vector<std::string> notes;
  std::vector<ReportStage> stages;
  // Among complete episodes without success, most frequent first.
  ReportCounts failure_reasons;
  // Number of new collisions per geom, over all complete episodes.
  ReportCounts collisions;
  std::vector<ReportMetric> metrics;
  // Only for realtime runs: a sentence about the timing of ticks, and the times of the worst episode.
  std::string pacing;
  std::vector<ReportTimes> times;
  std::vector<ReportEpisode> episode;
  // If there are no videos: a sentence that explains how to record them.
  std::string video_hint;
  std::vector<ReportCurves> curves;
  // Configuration of the run: options, versions, hashes.
  std::vector<std::pair<std::string, std::string>> made;
};

struct Report {
  std::string title;
  // At least one. If there are several, the page starts with a table of them.
  std::vector<ReportRun> runs;
  std::vector<std::string> remarks;
  // Nothing if the page has no 3D viewer.
  std::optional<viz::PackedViewer> viewer = {};
  // Version and commit of the program that wrote the page.
  std::string made_by;
};

std::string ReportPage(const Report& report);

}  // namespace evalbus::report
