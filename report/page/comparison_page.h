// Comparisons of runs with a baseline as one HTML page that works offline. Pure: equal input gives equal
// bytes.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "report/page/page.h"
#include "results/comparison.h"

namespace evalbus::report {

struct ComparisonPageParts {
  // At least one, all with the same baseline.
  std::vector<results::Comparison> comparisons;
  // Links to the videos of an episode.
  std::function<std::vector<ReportLink>(const std::filesystem::path& run, int episode)> videos;
  // Shows a pair in the page's 3D viewer, at the cause of the failure if one failed; empty if the page does
  // not have the pair.
  std::function<std::string(const results::TaskComparison& task, const results::ComparedPair& pair)>
      player_url;
  // Nothing if the page has no 3D viewer, and what it leaves out, one sentence each.
  std::optional<viz::PackedViewer> viewer;
  std::vector<std::string> viewer_notes;
  // Version and commit of the program that wrote the page.
  std::string made_by;
  // See Page().
  nlohmann::ordered_json source = nullptr;
};

std::string ComparisonPage(const ComparisonPageParts& parts);

}  // namespace evalbus::report
