// The sections of a run's report, one function each.
#pragma once

#include <string>

#include "report/page/markup.h"
#include "report/page/report_page.h"

namespace evalbus::report {

// A run, and where and how its sections are written.
struct RunSection {
  const ReportRun& run;
  // Prefix that makes anchors unique on a page with several runs.
  std::string id;
  // Element names of headings and of subheadings.
  const char* heading;
  const char* subheading;
  Markup* html;
};

// Anchor of an episode's row in the table.
inline std::string EpisodeId(const RunSection& section, const results::RecordedEpisode& episode) {
  return section.id + "episode-" + std::to_string(episode.episode);
}

// Success rate, failures and exclusions as sentences; the main numbers; one square per episode.
void WriteSummary(const RunSection& section);
// Verdicts of operators, if there are any, and their agreement with the automatic ones.
void WriteOperators(const RunSection& section);
// The first failures: image of the decisive moment, and the cause in a sentence.
void WriteFailures(const RunSection& section);
// Which start parameters influence success.
void WriteCircumstances(const RunSection& section);
// Stages, failure reasons, collisions.
void WriteStages(const RunSection& section);
// A histogram of each metric that varies, and all statistics as a table.
void WriteDistributions(const RunSection& section);
// The table of episodes.
void WriteEpisodes(const RunSection& section);
// Curves and events of selected episodes.
void WriteCurves(const RunSection& section);
// Configuration of the run, and the command that repeats it.
void WriteMade(const RunSection& section);

}  // namespace evalbus::report
