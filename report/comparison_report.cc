#include "report/comparison_report.h"

#include <algorithm>
#include <memory>

#include "report/page/comparison_page.h"
#include "report/page_links.h"
#include "report/viewer_pack.h"

namespace evalbus::report {
namespace {

// The runs of the page. A run that is in several comparisons is added once.
struct PackedRuns {
  explicit PackedRuns(const PageLinks& links) : pack(links) {}

  int Number(const std::filesystem::path& folder) {
    const auto known = std::ranges::find(folders, folder);
    if (known != folders.end()) return static_cast<int>(known - folders.begin());
    folders.push_back(folder);
    runs.push_back(std::make_unique<results::RecordedRun>(results::ReadRun(folder)));
    return pack.Add(*runs.back());
  }
  // Adds pairs of episodes, the baseline's episode first.
  void AddPairs(const results::TaskComparison& task, std::vector<std::vector<ViewerPack::Wanted>>* flipped,
                std::vector<std::vector<ViewerPack::Wanted>>* others) {
    const int baseline = Number(task.baseline_folder), run = Number(task.folder);
    for (const results::FlippedPair& pair : task.flipped) {
      flipped->push_back({{baseline, pair.baseline_episode}, {run, pair.episode}});
    }
    for (const results::RecordedEpisode& a : runs[static_cast<size_t>(baseline)]->episodes) {
      const bool is_flipped =
          std::ranges::find(task.flipped, a.seed, &results::FlippedPair::seed) != task.flipped.end();
      const auto& episodes = runs[static_cast<size_t>(run)]->episodes;
      const auto b = std::ranges::find(episodes, a.seed, &results::RecordedEpisode::seed);
      if (!is_flipped && b != episodes.end()) others->push_back({{baseline, a.episode}, {run, b->episode}});
    }
  }

  ViewerPack pack;
  std::vector<std::filesystem::path> folders;
  // Pointers keep the addresses of the runs stable.
  std::vector<std::unique_ptr<results::RecordedRun>> runs;
};

}  // namespace

BuiltPage ComparisonReport(const std::vector<results::Comparison>& comparisons,
                           const std::filesystem::path& file, const std::string& made_by, size_t most) {
  const PageLinks links(file);
  ComparisonPageParts parts{
      .comparisons = comparisons,
      .videos = [&](const std::filesystem::path& run, int episode) { return links.Videos(run, episode); },
      .viewer = {},
      .viewer_notes = {},
      .made_by = made_by};
  const std::string without_viewer = ComparisonPage(parts);
  if (most == 0) return {without_viewer, ""};
  PackedRuns packed(links);
  std::vector<std::vector<ViewerPack::Wanted>> flipped, others;
  for (const results::Comparison& comparison : comparisons) {
    for (const results::TaskComparison& task : comparison.tasks) packed.AddPairs(task, &flipped, &others);
  }
  // Flipped seeds of all tasks come before other pairs.
  flipped.insert(flipped.end(), others.begin(), others.end());
  packed.pack.Pack(flipped, without_viewer.size(), most);
  parts.viewer_notes = packed.pack.remarks();
  parts.viewer = packed.pack.Viewer();
  return {ComparisonPage(parts), packed.pack.Note()};
}

}  // namespace evalbus::report
