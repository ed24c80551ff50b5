#include "metrics/statistics/run_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "metrics/statistics/bootstrap.h"
#include "metrics/statistics/clopper_pearson.h"
#include "metrics/statistics/describe.h"

namespace evalbus::metrics {
namespace {

using nlohmann::ordered_json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::string_view kStage = "task_stage_reached.", kSlips = "slip_count_per_object.";

void Flatten(const ordered_json& value, const std::string& name,
             std::vector<std::pair<std::string, double>>* out) {
  if (value.is_boolean()) {
    out->emplace_back(name, value.get<bool>() ? 1 : 0);
  } else if (value.is_number()) {
    out->emplace_back(name, value.get<double>());
  } else if (value.is_object()) {
    for (const auto& [key, child] : value.items()) Flatten(child, name.empty() ? key : name + "." + key, out);
  }
}

// Adds to the count of this name, which is appended if it is not there.
template <class Number>
void Count(const std::string& name, Number count, std::vector<std::pair<std::string, Number>>* counts) {
  for (auto& [other, sum] : *counts) {
    if (other != name) continue;
    sum += count;
    return;
  }
  counts->emplace_back(name, count);
}

template <class Number>
void MostFrequentFirst(std::vector<std::pair<std::string, Number>>* counts) {
  std::sort(counts->begin(), counts->end(), [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first < b.first;
  });
}

MetricSummary Describe(const std::string& name, const std::vector<double>& sorted, bool with_bootstrap) {
  return {.name = name,
          .episodes = static_cast<int>(sorted.size()),
          .mean = Mean(sorted),
          .std = StandardDeviation(sorted),
          .median = Quantile(sorted, 0.5),
          .p5 = Quantile(sorted, 0.05),
          .p95 = Quantile(sorted, 0.95),
          .min = sorted.front(),
          .max = sorted.back(),
          .mean_95 = with_bootstrap ? BootstrapMean(sorted) : Interval{kNaN, kNaN}};
}

ordered_json Json(const Interval& interval) { return {interval.lower, interval.upper}; }

template <class Number>
ordered_json Json(const std::vector<std::pair<std::string, Number>>& counts) {
  ordered_json json = ordered_json::object();
  for (const auto& [name, count] : counts) json[name] = count;
  return json;
}

}  // namespace

EpisodeResult ResultOf(const ordered_json& episode) {
  EpisodeResult result{.complete = episode.at("complete").get<bool>(),
                       .success = episode.at("metrics").at("success") == 1,
                       .failure_reason = episode.at("failure_reason").get<std::string>(),
                       .metrics = episode.at("metrics"),
                       .collisions = {}};
  result.metrics["extended"] = episode.at("extended");
  if (const auto explanation = episode.find("explanation"); explanation != episode.end()) {
    const auto collisions = explanation->find("collisions_per_geom");
    if (collisions != explanation->end()) collisions->get_to(result.collisions);
  }
  return result;
}

std::vector<std::pair<std::string, double>> FlattenedValues(const ordered_json& metrics) {
  std::vector<std::pair<std::string, double>> values;
  Flatten(metrics, "", &values);
  return values;
}

const MetricSummary* RunSummary::Find(const std::string& metric) const {
  for (const MetricSummary& summary : metrics) {
    if (summary.name == metric) return &summary;
  }
  return nullptr;
}

size_t RunStatistics::Index(const std::string& name) {
  const size_t index = std::find(names_.begin(), names_.end(), name) - names_.begin();
  if (index == names_.size()) {
    names_.push_back(name);
    sorted_.emplace_back();
  }
  return index;
}

void RunStatistics::Add(int episode, const EpisodeResult& result) {
  Entry& entry = episodes_[episode];
  for (const auto& [index, value] : entry.values) {
    std::vector<double>& sorted = sorted_[index];
    sorted.erase(std::lower_bound(sorted.begin(), sorted.end(), value));
  }
  entry = {};
  entry.complete = result.complete;
  if (!result.complete) return;
  entry.success = result.success;
  entry.failure_reason = result.failure_reason;
  entry.collisions = result.collisions;
  for (const auto& [name, value] : FlattenedValues(result.metrics)) {
    if (name == "success") continue;
    if (name.starts_with(kStage)) {
      entry.stages.emplace_back(name.substr(kStage.size()), value != 0);
      continue;
    }
    if (name.starts_with(kSlips)) entry.slips.emplace_back(name.substr(kSlips.size()), std::llround(value));
    const size_t index = Index(name);
    entry.values.emplace_back(index, value);
    sorted_[index].insert(std::upper_bound(sorted_[index].begin(), sorted_[index].end(), value), value);
  }
}

RunSummary RunStatistics::Summary(bool with_bootstrap) const {
  RunSummary summary;
  std::vector<std::pair<std::string, int>> stages;
  for (const auto& [number, episode] : episodes_) {
    ++summary.episodes;
    if (!episode.complete) continue;
    ++summary.complete;
    summary.successes += episode.success;
    if (!episode.success) Count(episode.failure_reason, 1, &summary.failure_reasons);
    for (const auto& [index, reached] : episode.stages) Count(index, reached, &stages);
    for (const auto& [object, count] : episode.slips) Count(object, count, &summary.slips_per_object);
    for (const auto& [geom, count] : episode.collisions) Count(geom, count, &summary.collisions_per_geom);
  }
  for (const auto& [index, reached] : stages) summary.stages.push_back({index, reached});
  MostFrequentFirst(&summary.failure_reasons);
  MostFrequentFirst(&summary.collisions_per_geom);
  summary.success_rate =
      summary.complete > 0 ? static_cast<double>(summary.successes) / summary.complete : kNaN;
  summary.wilson = WilsonInterval(summary.successes, summary.complete);
  summary.clopper_pearson = ClopperPearsonInterval(summary.successes, summary.complete);
  for (size_t i = 0; i < names_.size(); ++i) {
    if (!sorted_[i].empty()) summary.metrics.push_back(Describe(names_[i], sorted_[i], with_bootstrap));
  }
  return summary;
}

run_summary_t SummaryMessage(const RunSummary& summary) {
  run_summary_t message{};
  message.num_episodes = summary.episodes;
  message.num_complete = summary.complete;
  message.num_success = summary.successes;
  message.success_rate = summary.success_rate;
  message.success_rate_lower = summary.wilson.lower;
  message.success_rate_upper = summary.wilson.upper;
  message.success_rate_exact_lower = summary.clopper_pearson.lower;
  message.success_rate_exact_upper = summary.clopper_pearson.upper;
  message.num_stages = static_cast<int32_t>(summary.stages.size());
  for (const StageSummary& stage : summary.stages) {
    message.stage_index.push_back(std::stoi(stage.index));
    message.stage_episodes.push_back(stage.reached);
  }
  message.num_failure_reasons = static_cast<int32_t>(summary.failure_reasons.size());
  for (const auto& [reason, count] : summary.failure_reasons) {
    message.failure_reason.push_back(reason);
    message.failure_episodes.push_back(count);
  }
  message.num_metrics = static_cast<int32_t>(summary.metrics.size());
  for (const MetricSummary& metric : summary.metrics) {
    message.metric_name.push_back(metric.name);
    message.mean_mixed.push_back(metric.mean);
    message.std_mixed.push_back(metric.std);
    message.median_mixed.push_back(metric.median);
    message.p5_mixed.push_back(metric.p5);
    message.p95_mixed.push_back(metric.p95);
    message.min_mixed.push_back(metric.min);
    message.max_mixed.push_back(metric.max);
  }
  return message;
}

ordered_json SummaryJson(const std::string& task, const std::string& variation, const RunSummary& summary) {
  ordered_json json = {{"task", task},
                       {"variation", variation},
                       {"episodes", summary.episodes},
                       {"complete", summary.complete},
                       {"successes", summary.successes},
                       {"success_rate", summary.success_rate},
                       {"success_rate_wilson_95", Json(summary.wilson)},
                       {"success_rate_clopper_pearson_95", Json(summary.clopper_pearson)}};
  ordered_json& stages = json["stages"] = ordered_json::object();
  for (const StageSummary& stage : summary.stages) {
    stages[stage.index] = {{"reached", stage.reached},
                           {"share", static_cast<double>(stage.reached) / summary.complete},
                           {"share_wilson_95", Json(WilsonInterval(stage.reached, summary.complete))}};
  }
  json["failure_reasons"] = Json(summary.failure_reasons);
  json["slips_per_object"] = Json(summary.slips_per_object);
  json["collisions_per_geom"] = Json(summary.collisions_per_geom);
  ordered_json& metrics = json["metrics"] = ordered_json::object();
  for (const MetricSummary& metric : summary.metrics) {
    // What one episode cannot say (NaN) becomes null.
    metrics[metric.name] = {
        {"episodes", metric.episodes}, {"mean", metric.mean},     {"mean_95", Json(metric.mean_95)},
        {"std", metric.std},           {"median", metric.median}, {"p5", metric.p5},
        {"p95", metric.p95},           {"min", metric.min},       {"max", metric.max}};
  }
  return json;
}

}  // namespace evalbus::metrics
