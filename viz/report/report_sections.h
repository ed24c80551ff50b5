// The sections of a run's report, one function each.
#pragma once

#include <string>

#include "viz/report/markup.h"
#include "viz/report/report_page.h"

namespace evalbus::viz {

// A run, and where and how its sections are written.
struct RunSection {
  const ReportRun& run;
  // Makes anchors unique on a page with several runs.
  std::string id;
  // Elements of headings, and of those one level below.
  const char* heading;
  const char* subheading;
  Markup* html;
};

// Of an episode's row in the table.
inline std::string EpisodeId(const RunSection& section, const ReportEpisode& episode) {
  return section.id + "episode-" + std::to_string(episode.episode);
}

// Rate, failures and what is left out in sentences; the main numbers; a square for each episode.
void WriteSummary(const RunSection& section);
// Stages, failure reasons, collisions.
void WriteStages(const RunSection& section);
// A histogram of each metric that varies, and all statistics as a table.
void WriteDistributions(const RunSection& section);
// The table of episodes.
void WriteEpisodes(const RunSection& section);
// The episodes that were chosen, tick by tick.
void WriteCurves(const RunSection& section);
// How the run was made.
void WriteMade(const RunSection& section);

}  // namespace evalbus::viz
