#include "report/comparison_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>

#include "base/plural.h"
#include "report/page/comparison_page.h"
#include "report/page_links.h"
#include "report/viewer_pack.h"

namespace evalbus::report {
namespace {

double Rate(int successes, int trials) {
  return trials > 0 ? static_cast<double>(successes) / trials : std::numeric_limits<double>::quiet_NaN();
}

ReportDifference Success(const std::string& name, const results::SuccessComparison& success) {
  return {.name = name,
          .unit = "",
          .baseline = Rate(success.baseline_successes, success.baseline_trials),
          .run = Rate(success.successes, success.trials),
          .difference = success.difference,
          .lower = success.difference_95.lower,
          .upper = success.difference_95.upper,
          .p = success.p,
          .p_holm = success.p_adjusted,
          .judgment = results::Word(success.judgment())};
}

ReportDifference Metric(const results::MetricComparison& metric) {
  const double scale = metric.number.scale();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  return {.name = metric.number.label() + (metric.number.metric->effort ? " *" : ""),
          .unit = std::string(metric.number.shown_unit()),
          .baseline = metric.baseline_mean * scale,
          .run = metric.mean * scale,
          .difference = metric.difference * scale,
          .lower = metric.difference_95.lower * scale,
          .upper = metric.difference_95.upper * scale,
          .p = metric.p.value_or(kNaN),
          .p_holm = metric.p ? metric.p_holm : kNaN,
          .judgment = results::Word(metric.judgment())};
}

ReportFlip Flip(const results::TaskComparison& task, const results::FlippedPair& pair,
                const PageLinks& links) {
  return {.seed = pair.seed,
          .baseline = pair.success ? pair.failure_reason : "",
          .run = pair.success ? "" : pair.failure_reason,
          .baseline_episode = pair.baseline_episode,
          .run_episode = pair.episode,
          .baseline_videos = links.Videos(task.baseline_folder, pair.baseline_episode),
          .run_videos = links.Videos(task.folder, pair.episode)};
}

ReportTaskComparison Task(const results::TaskComparison& task, const PageLinks& links) {
  ReportTaskComparison report;
  report.task = task.name();
  report.success = Success(report.task, task.success);
  report.counts = results::WhatIsCounted(task);
  for (const results::MetricComparison& metric : task.metrics) report.metrics.push_back(Metric(metric));
  bool any_video = false;
  for (const results::FlippedPair& pair : task.flipped) {
    report.flips.push_back(Flip(task, pair, links));
    any_video =
        any_video || !report.flips.back().run_videos.empty() || !report.flips.back().baseline_videos.empty();
  }
  if (!task.flipped.empty() && !any_video) {
    report.video_hint =
        "There are no videos of these: evalbus render RUN --episode N makes them; run evalbus compare "
        "--report again to link them here.";
  }
  return report;
}

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
  std::vector<ReportComparison> reports;
  for (const results::Comparison& comparison : comparisons) {
    ReportComparison report;
    report.run = fmt::format("{} ({})", comparison.run.name, comparison.run.policy);
    report.baseline = fmt::format("{} ({})", comparison.baseline.name, comparison.baseline.policy);
    report.verdict = results::Conclusion(comparison);
    for (const results::TaskComparison& task : comparison.tasks) report.tasks.push_back(Task(task, links));
    report.success = Success("all", comparison.success);
    report.notes = comparison.remarks;
    report.notes.push_back(
        fmt::format("p of success: {}. Adjusted p: adjusted for the number of tests in a table. {} Each "
                    "interval has its own scale.",
                    results::TestName(comparison.success.test), results::kIntervalsAreSingle));
    reports.push_back(std::move(report));
  }
  const auto html = [&](const std::optional<viz::PackedViewer>& viewer) {
    return ComparisonPage("Comparison with " + reports.front().baseline, reports, made_by, viewer);
  };
  if (most == 0) return {html({}), ""};
  PackedRuns packed(links);
  std::vector<std::vector<ViewerPack::Wanted>> flipped, others;
  for (const results::Comparison& comparison : comparisons) {
    for (const results::TaskComparison& task : comparison.tasks) packed.AddPairs(task, &flipped, &others);
  }
  // Flipped seeds of all tasks come before other pairs.
  flipped.insert(flipped.end(), others.begin(), others.end());
  packed.pack.Pack(flipped, html({}).size(), most);
  for (const std::string& remark : packed.pack.remarks()) reports.front().notes.push_back(remark);
  return {html(packed.pack.Viewer()), packed.pack.Note()};
}

}  // namespace evalbus::report
