#include "results/tally.h"

#include <fmt/format.h>

#include "base/styled_text.h"
#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "results/summary_table.h"

namespace evalbus::results {
namespace {

std::string Row(const std::string& name, size_t width, const std::string& success, const std::string& rate,
                const std::string& time, const std::string& why) {
  std::string line = fmt::format("{:<{}}  {:>9}  {:>14}  {:>12}  {}", name, width, success, rate, time, why);
  return line.substr(0, line.find_last_not_of(' ') + 1);
}

std::vector<std::pair<std::string, int>> FailuresOf(const metrics::RunSummary& summary) {
  auto failures = summary.failure_reasons;
  if (summary.invalid > 0) failures.emplace_back("invalid", summary.invalid);
  if (const int incomplete = summary.episodes - summary.complete - summary.invalid; incomplete > 0) {
    failures.emplace_back("incomplete", incomplete);
  }
  return failures;
}

}  // namespace

void Tally::Add(const RecordedRun& run) {
  for (const RecordedEpisode& episode : run.episodes) {
    statistics_.Add(episodes_++, episode, tasks_);
  }
  ++tasks_;
}

nlohmann::ordered_json Tally::Json() const {
  const metrics::RunSummary summary = statistics_.Summary(false);
  const metrics::MetricSummary* time = summary.Find("completion_time");
  nlohmann::ordered_json json = metrics::RatesJson(summary);
  json["mean_completion_time_s"] = time ? nlohmann::ordered_json(time->mean) : nullptr;
  nlohmann::ordered_json& reasons = json["failure_reasons"] = nlohmann::ordered_json::object();
  for (const auto& [reason, count] : FailuresOf(summary)) reasons[reason] = count;
  return json;
}

std::string Tally::Title(const std::string& what, size_t width, bool colors) {
  return Styled(Row(what, width, "success", "95 % interval", "success time", "remarks"), Style::kStrong,
                colors) +
         "\n";
}

std::string Tally::Line(const std::string& name, size_t width, bool colors) const {
  const metrics::RunSummary summary = statistics_.Summary(false);
  const metrics::MetricSummary* time = summary.Find("completion_time");
  std::string notes;
  const auto add = [&notes](const std::string& note) { notes += (notes.empty() ? "" : ", ") + note; };
  for (const auto& [reason, count] : FailuresOf(summary))
    add(fmt::format("{} {}", count, end_reason::Text(Printable(reason))));
  if (!notes.empty()) notes = Styled(notes, Style::kBad, colors);
  if (summary.samples < summary.complete) {
    add(fmt::format("equal episodes: the interval counts {}", summary.samples));
  }
  // The notes of each run state if no start was seen in training; in this column only other counts are shown.
  if (summary.seen_in_training.value_or(0) > 0) add(summary.TrainingText());
  const bool judged = summary.judged > 0 || summary.complete == 0;
  return Row(name, width, judged ? fmt::format("{} of {}", summary.successes, summary.judged) : "not judged",
             judged ? PercentText(summary.wilson) : "-", time ? fmt::format("{:.2f} s", time->mean) : "-",
             notes) +
         "\n";
}

}  // namespace evalbus::results
