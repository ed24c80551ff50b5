// The report of a run, or of several, as one HTML page that opens without a network. Pure: from the structs
// below to text; equal input, equal bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "viz/report/figures.h"
#include "viz/report/page.h"

namespace evalbus::viz {

struct ReportEpisode {
  int episode = 0;
  int64_t seed = 0;
  std::string end_reason;
  std::string failure_reason;  // empty on success
  std::string explanation;     // a sentence; may be empty
  bool complete = true;
  bool success = false;
  // Metrics by their names in summary.json, which outlive this.
  std::vector<std::pair<std::string_view, double>> values;
  std::vector<ReportLink> videos;
  std::vector<ReportLink> logs;
};

// A number that describes the distribution of a metric, by its name in summary.json; two numbers are an
// interval.
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
  // Complete episodes that reached it, and the median time at which they did, s; NaN where none did.
  int reached = 0;
  double median_time = 0;
};

// How times are distributed, s.
struct ReportTimes {
  std::string name;
  double p50, p99, p999, max;
};

using ReportCounts = std::vector<std::pair<std::string, int64_t>>;

// What happened in one episode, tick by tick.
struct ReportCurves {
  int episode = 0;
  std::string why;  // it was chosen: "first failure"
  std::vector<CurveFigure> figures;
  std::vector<EpisodeEvent> events;
};

struct ReportRun {
  std::string name;
  std::string task;
  std::string variation;
  std::string policy;
  // Episodes that are finished, those that are complete, and successes among the complete ones.
  int episodes = 0, complete = 0, successes = 0;
  // Complete ones of which nobody can say whether they succeeded: in no rate.
  int not_judged = 0;
  // 95 %; the first one is the one that is drawn and quoted.
  std::vector<ReportInterval> intervals;
  // What a reader has to know before the numbers, a sentence each.
  std::vector<std::string> remarks;
  // How its policy was run, likewise.
  std::vector<std::string> notes;
  std::vector<ReportStage> stages;
  // Of the complete episodes without success, the most frequent first.
  ReportCounts failure_reasons;
  // New collisions by geom, over all complete episodes.
  ReportCounts collisions;
  std::vector<ReportMetric> metrics;
  // Of a run in real time: a sentence about its ticks, and its times in its worst episode.
  std::string pacing;
  std::vector<ReportTimes> times;
  std::vector<ReportEpisode> episode;
  // How videos are made, where there are none; a sentence.
  std::string video_hint;
  std::vector<ReportCurves> curves;
  // How the run was made: options, versions, hashes.
  std::vector<std::pair<std::string, std::string>> made;
};

struct Report {
  std::string title;
  // At least one; with several, a table of them comes first.
  std::vector<ReportRun> runs;
  std::vector<std::string> remarks;
  // Nothing: none.
  std::optional<PackedViewer> viewer = {};
  // Version and commit of the program that wrote the page.
  std::string made_by;
};

std::string ReportPage(const Report& report);

}  // namespace evalbus::viz
