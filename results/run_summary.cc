#include "results/run_summary.h"

#include <fmt/format.h>

#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "metrics/statistics/describe.h"
#include "results/pacing.h"
#include "results/policy_calls.h"

namespace evalbus::results {
namespace {

nlohmann::ordered_json RunSummaryJson(const RecordedRun& run, const metrics::RunSummary& statistics) {
  auto json = metrics::SummaryJson(run.task, run.variation, statistics);
  if (run.info.value("realtime", false)) json["pacing"] = RunPacing(run);
  return json;
}

}  // namespace

nlohmann::ordered_json RunSummaryJson(const RecordedRun& run) {
  return RunSummaryJson(run, run.Statistics().Summary(true));
}

RunSummary WriteRunSummary(const std::filesystem::path& folder) {
  const RecordedRun recorded = ReadRunAsFarAsItGot(folder);
  std::string lines;
  for (const RecordedEpisode& episode : recorded.episodes) lines += episode.text + "\n";
  if (!lines.empty()) WriteWhole(folder / kEpisodesJsonl, lines);
  RunSummary summary{recorded.Statistics().Summary(true), RunPacing(recorded), PolicyNotes(recorded), {}};
  for (const RecordedEpisode& episode : recorded.episodes) {
    if (!episode.complete || episode.success || !episode.judged()) continue;
    summary.failed.push_back({episode.episode, episode.failure_reason, episode.cause});
  }
  WriteWhole(folder / kSummaryJson, ToText(RunSummaryJson(recorded, summary.statistics), 2) + "\n");
  return summary;
}

void SuiteTally::Add(const std::string& name, const RecordedRun& run) {
  by_task_[name].Add(run);
  families_[run.task].Add(run);
  all_.Add(run);
}

double SuiteTally::mean_over_tasks() const {
  std::vector<double> rates;
  for (const auto& [name, tally] : by_task_) {
    if (const metrics::RunSummary summary = tally.Summary(); summary.judged > 0)
      rates.push_back(summary.success_rate);
  }
  return metrics::Mean(rates);
}

std::string SuiteTally::MeanLine(size_t width) const {
  if (by_task_.size() < 2) return "";
  const double mean = mean_over_tasks();
  return fmt::format("{:<{}}  {:>9}  all tasks have equal weight; in \"all\", all complete episodes do\n",
                     "mean of tasks", width, Percent(mean));
}

nlohmann::ordered_json SuiteTally::Json(const std::vector<std::string>& names) const {
  nlohmann::ordered_json json = {{"all", all_.Json()}};
  json["all"]["mean_success_rate_of_tasks"] = mean_over_tasks();
  for (const auto& [name, tally] : families_) json["by_task"][name] = tally.Json();
  for (const std::string& name : names) {
    if (by_task_.contains(name)) json["by_variation"][name] = by_task_.at(name).Json();
  }
  return json;
}

}  // namespace evalbus::results
