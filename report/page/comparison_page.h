// Generates one HTML page, which works offline, from comparisons of runs with a baseline. Equal input gives
// equal bytes.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "report/page/markup.h"
#include "report/page/page.h"
#include "results/comparison.h"

namespace evalbus::report {

// Images of both episodes of a pair at the decisive moment of the failed one, as data URLs.
struct PairStills {
  std::string baseline, run;
};

struct ComparisonPageParts {
  // Must not be empty; all comparisons must have the same baseline.
  std::vector<results::Comparison> comparisons;
  // Returns links to the videos of an episode.
  std::function<std::vector<ReportLink>(const std::filesystem::path& run, int episode)> videos;
  // Returns the URL that shows a pair in the page's 3D viewer, at the decisive moment if one of the episodes
  // failed; empty if the page does not contain the pair.
  std::function<std::string(const results::TaskComparison& task, const results::ComparedPair& pair)>
      player_url;
  // Returns the images of a pair; null if it has none.
  std::function<const PairStills*(const results::TaskComparison& task, const results::ComparedPair& pair)>
      stills;
  // viewer: nullopt if the page has no 3D viewer. viewer_notes: notes on images and episodes that are
  // omitted, one sentence each.
  std::optional<viz::PackedViewer> viewer;
  std::vector<std::string> viewer_notes;
  // Version and commit of the program that wrote the page.
  std::string made_by;
  // Source of the page; see Page().
  nlohmann::ordered_json source = nullptr;
};

std::string ComparisonPage(const ComparisonPageParts& parts);

// Writes the success rates of both sides and their difference, by task and over all tasks.
void WriteSuccess(const results::Comparison& comparison, Markup* html);
// Writes the outcomes of both sides by seed. A table lists the seeds where only one side succeeded, with
// causes and links to the 3D viewer. heading: HTML element of the heading, for example "h2".
void WriteSeeds(const ComparisonPageParts& parts, const results::Comparison& comparison,
                const results::TaskComparison& task, const char* heading, Markup* html);
// Writes the compared metrics with their relative changes on one axis.
void WriteMetrics(const results::Comparison& comparison, const results::TaskComparison& task,
                  const char* heading, Markup* html);

}  // namespace evalbus::report
