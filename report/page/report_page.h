// Generates the report of one or several runs as one HTML page that works offline. Equal input gives equal
// bytes.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "metrics/statistics/run_statistics.h"
#include "report/page/figures.h"
#include "report/page/page.h"
#include "results/circumstances.h"
#include "results/no_return.h"
#include "results/run_reader.h"

namespace evalbus::report {

struct EpisodeFiles {
  std::vector<ReportLink> videos;
  std::vector<ReportLink> logs;
};

// Decisive moment of an episode. image: image as a data URL. url: link to the moment in the page's 3D viewer.
// Either may be empty.
struct ReportMoment {
  std::string image, url;
};

// Curves and events of one episode.
struct ReportCurves {
  int episode = 0;
  std::string why;  // reason for the selection, such as "first failure"
  std::vector<CurveFigure> figures;
  std::vector<EpisodeEvent> events;
};

struct ReportRun {
  results::RecordedRun run;
  // Statistics of `run`, with bootstrap intervals.
  metrics::RunSummary summary;
  // Caveats that are shown above the numbers, one line each.
  std::vector<std::string> remarks;
  // Caveats about images, one sentence each.
  std::vector<std::string> image_remarks{};
  // Sentences on how the policy was run.
  std::vector<std::string> notes;
  // Success rates by the verdicts of operators, and their agreement with the automatic verdicts, one sentence
  // each; empty if there are none.
  std::vector<std::string> operators{};
  // Influence of the start parameters on success; p-values are adjusted for all runs of the report.
  results::RunCircumstances circumstances;
  // Points of no return by episode; empty unless `evalbus why` has searched for them.
  results::NoReturns no_returns;
  // Pacing of a real-time run (results::RunPacing); null for other runs.
  nlohmann::ordered_json pacing;
  // Command line that repeats the run; empty if there is none.
  std::string command;
  // Decisive moments of failures, by episode. Only the first ones have images.
  std::map<int, ReportMoment> moments;
  // Files of each episode, in the order of run.episodes.
  std::vector<EpisodeFiles> files;
  // Values that were read from the logs: curves of selected episodes, names of stages by index, and hashes of
  // the models by key.
  std::vector<ReportCurves> curves;
  std::map<int, std::string> stage_name;
  std::vector<std::pair<std::string, std::string>> model_hashes;
};

struct Report {
  std::string title;
  // Must contain at least one run. If there are several, the page begins with a table of the runs.
  std::vector<ReportRun> runs;
  std::vector<std::string> remarks;
  // Remarks about the 3D viewer, one sentence each.
  std::vector<std::string> viewer_remarks = {};
  // The 3D viewer; nullopt if the page has none.
  std::optional<viz::PackedViewer> viewer = {};
  // URL fragment of the episode that the viewer shows first.
  std::string opened = {};
  // Version and commit of the program that wrote the page.
  std::string made_by;
  // Source of the page; see Page().
  nlohmann::ordered_json source = nullptr;
};

std::string ReportPage(const Report& report);

}  // namespace evalbus::report
