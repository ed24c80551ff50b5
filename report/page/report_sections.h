// Functions that write the sections of a run's report, and helper functions that several sections use.
#pragma once

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "report/page/markup.h"
#include "report/page/report_page.h"

namespace evalbus::report {

// A run, and the parameters for writing its sections.
struct RunSection {
  const ReportRun& run;
  // Prefix that makes anchors unique on a page with several runs.
  std::string id;
  // Element names of headings and of subheadings.
  const char* heading;
  const char* subheading;
  Markup* html;
};

// Returns the HTML id of an episode's row in the table.
inline std::string EpisodeId(const RunSection& section, const results::RecordedEpisode& episode) {
  return section.id + "episode-" + std::to_string(episode.episode);
}

// Returns NaN if the episode does not have the metric.
double ValueOf(const results::RecordedEpisode& episode, const std::string& metric);
// Returns the first of these metrics that the episode has. Robots with one arm and with two arms have
// different metric names.
double FirstOf(const results::RecordedEpisode& episode, std::initializer_list<const char*> metrics);

// Returns NaN if no episode has the metric.
double MeanOf(const ReportRun& run, const std::string& metric);

// Returns the sentence that explains how the episode ended: its cause or, in runs of older versions, its
// explanation.
const std::string& WhyOf(const results::RecordedEpisode& episode);

// Returns the reasons of failed episodes and their counts, without the episodes that were not judged.
std::vector<std::pair<std::string, int>> FailureReasonsOf(const metrics::RunSummary& summary);

// Returns the CSS class of an episode's outcome: "good", "bad" or, for an episode that is not complete or was
// not judged, "incomplete".
const char* Outcome(const results::RecordedEpisode& episode);

// Writes sentences on success rate, failures and exclusions, the main numbers, and one square per episode.
void WriteSummary(const RunSection& section);
// Writes the verdicts of operators, if there are any, and their agreement with the automatic verdicts.
void WriteOperators(const RunSection& section);
// Writes the first failures, with an image of the decisive moment and a sentence on the cause.
void WriteFailures(const RunSection& section);
// Writes which start parameters influence success.
void WriteCircumstances(const RunSection& section);
// Writes stages, failure reasons and collisions.
void WriteStages(const RunSection& section);
// Writes a histogram of each metric that varies, and all statistics as a table.
void WriteDistributions(const RunSection& section);
// Writes the table of episodes.
void WriteEpisodes(const RunSection& section);
// Writes curves and events of selected episodes.
void WriteCurves(const RunSection& section);
// Writes the configuration of the run, and the command that repeats it.
void WriteMade(const RunSection& section);

}  // namespace evalbus::report
