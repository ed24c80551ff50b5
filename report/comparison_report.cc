#include "report/comparison_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>

#include "base/errors.h"
#include "report/page/comparison_page.h"
#include "report/page/page_check.h"
#include "report/page_links.h"
#include "report/stills.h"
#include "report/viewer_pack.h"

namespace evalbus::report {
namespace {

// The runs of the page. A run that occurs in several comparisons is added once.
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
    for (const results::ComparedPair& pair : task.pairs) {
      (pair.is_flipped() ? flipped : others)
          ->push_back({{baseline, pair.baseline.episode}, {run, pair.run.episode}});
    }
  }
  // Returns the URL that shows the pair at the decisive moment of the side that failed or, if the pair is not
  // flipped, of the run; empty if the page lacks one of the episodes.
  std::string PlayerUrlOf(const results::TaskComparison& task, const results::ComparedPair& pair) {
    const PlayerPlace baseline{Number(task.baseline_folder), pair.baseline.episode};
    const PlayerPlace run{Number(task.folder), pair.run.episode};
    if (!pack.has(baseline.run, baseline.episode) || !pack.has(run.run, run.episode)) return "";
    return PlayerUrl(baseline, pair.is_flipped() ? pair.failed().cause : pair.run.cause, run);
  }

  ViewerPack pack;
  std::vector<std::filesystem::path> folders;
  // Stored as pointers because `pack` refers to the runs, so their addresses must not change.
  std::vector<std::unique_ptr<results::RecordedRun>> runs;
};

// Images of the seeds where only one side succeeds.
class MomentStills {
 public:
  // Draws the first pairs of each task.
  void Draw(const std::vector<results::Comparison>& comparisons, std::vector<std::string>* remarks) {
    size_t tasks = 0, left = kMaxStills / 2;
    for (const results::Comparison& comparison : comparisons) tasks += comparison.tasks.size();
    const size_t of_each = std::max<size_t>(1, left / std::max<size_t>(1, tasks));
    std::optional<StillRenderer> renderer;
    for (const results::Comparison& comparison : comparisons) {
      for (const results::TaskComparison& task : comparison.tasks) {
        size_t drawn = 0;
        for (const results::ComparedPair& pair : task.flipped()) {
          if (drawn == of_each || left == 0) break;
          const results::Cause& cause = pair.failed().cause;
          if (cause.text.empty()) continue;
          ++drawn;
          --left;
          try {
            if (!renderer) renderer.emplace();
            stills_[{task.folder, pair.run.episode}] = {
                renderer->DrawMoment(task.baseline_folder, pair.baseline.episode, cause.time_s),
                renderer->DrawMoment(task.folder, pair.run.episode, cause.time_s)};
          } catch (const InputError& error) {
            remarks->push_back(fmt::format("no images of episode {}: {}", pair.run.episode, error.what()));
          } catch (const EnvironmentError& error) {
            // A plan on a machine without OpenGL still writes its pages.
            remarks->push_back(std::string("no images of the decisive moments: ") + error.what());
            return;
          }
        }
      }
    }
  }
  const PairStills* Of(const results::TaskComparison& task, const results::ComparedPair& pair) const {
    const auto found = stills_.find({task.folder, pair.run.episode});
    return found == stills_.end() ? nullptr : &found->second;
  }

 private:
  std::map<std::pair<std::filesystem::path, int>, PairStills> stills_;  // by the run's folder and episode
};

}  // namespace

BuiltPage ComparisonReport(const std::vector<results::Comparison>& comparisons,
                           const std::filesystem::path& file, const std::string& made_by, size_t most,
                           const nlohmann::ordered_json& source) {
  const PageLinks links(file);
  MomentStills stills;
  ComparisonPageParts parts{
      .comparisons = comparisons,
      .videos = [&](const std::filesystem::path& run, int episode) { return links.Videos(run, episode); },
      .player_url = [](const auto&, const auto&) { return std::string(); },
      .stills = [&](const auto& task, const auto& pair) { return stills.Of(task, pair); },
      .viewer = {},
      .viewer_notes = {},
      .made_by = made_by,
      .source = source};
  if (most == 0) return {ComparisonPage(parts), ""};
  stills.Draw(comparisons, &parts.viewer_notes);
  // The page is first generated with placeholder links of about the final length, to determine its size.
  parts.player_url = [](const auto&, const auto&) {
    return std::string("#view:run=00,episode=0000,t=00.000");
  };
  const std::string without_viewer = ComparisonPage(parts);
  PackedRuns packed(links);
  std::vector<std::vector<ViewerPack::Wanted>> flipped, others;
  for (const results::Comparison& comparison : comparisons) {
    for (const results::TaskComparison& task : comparison.tasks) packed.AddPairs(task, &flipped, &others);
  }
  // Flipped seeds of all tasks come before other pairs.
  flipped.insert(flipped.end(), others.begin(), others.end());
  packed.pack.Pack(flipped, without_viewer.size(), most);
  for (const std::string& remark : packed.pack.remarks()) parts.viewer_notes.push_back(remark);
  parts.viewer = packed.pack.Viewer();
  parts.player_url = [&](const results::TaskComparison& task, const results::ComparedPair& pair) {
    return packed.PlayerUrlOf(task, pair);
  };
  return {ComparisonPage(parts), packed.pack.Note()};
}

nlohmann::ordered_json ComparisonSource(const std::vector<results::Comparison>& comparisons,
                                        const std::filesystem::path& file) {
  const auto of = [&](const results::ComparedRuns& runs) {
    return nlohmann::ordered_json{{"folder", RelativeToPage(runs.folder, file)}, {"name", runs.name}};
  };
  nlohmann::ordered_json source = {{"page", kComparisonPage}, {"baseline", of(comparisons.front().baseline)}};
  for (const results::Comparison& comparison : comparisons) source["runs"].push_back(of(comparison.run));
  if (!comparisons.front().on.empty()) source["on"] = comparisons.front().on;
  return source;
}

}  // namespace evalbus::report
