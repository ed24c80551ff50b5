// Generates one HTML page, which works offline, from comparisons of runs with a baseline. Equal input gives
// equal bytes.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

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

}  // namespace evalbus::report
