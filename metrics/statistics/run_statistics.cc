#include "metrics/statistics/run_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "base/interned.h"
#include "base/number_from.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/metric_catalog.h"
#include "metrics/statistics/clopper_pearson.h"
#include "metrics/statistics/confidence_sequence.h"
#include "metrics/statistics/describe.h"
#include "metrics/statistics/interval_of_mean.h"

namespace evalbus::metrics {
namespace {

using nlohmann::ordered_json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr char kObject[] = "object_";
constexpr int kMaxObjects = 10'000;
constexpr char kSuccess[] = "success", kStages[] = "task_stage_reached", kSlips[] = "slip_count_per_object";

void Flatten(const ordered_json& value, const std::string& name, NamedNumbers* out) {
  if (value.is_boolean()) {
    out->emplace_back(Interned(name), value.get<bool>() ? 1 : 0);
  } else if (value.is_number()) {
    out->emplace_back(Interned(name), value.get<double>());
  } else if (value.is_object()) {
    for (const auto& [key, child] : value.items()) Flatten(child, name.empty() ? key : name + "." + key, out);
  }
}

// Adds `count` to the entry with this key; appends the entry if it is missing.
template <class Key, class Number>
void Count(const Key& name, Number count, std::vector<std::pair<Key, Number>>* counts) {
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

// Returns the interval of the mean, clipped to the metric's valid range.
Interval MeanInterval(const std::string& name, const std::vector<double>& sorted) {
  Interval interval = IntervalOfMean(sorted);
  if (const MetricInfo* metric = FindMetric(name).metric; metric && std::isfinite(interval.lower)) {
    interval = {std::max(interval.lower, metric->least), std::min(interval.upper, metric->most)};
  }
  return interval;
}

// is_one_sample: whether all episodes are repetitions that count as one sample.
MetricSummary Describe(const std::string& name, const std::vector<double>& sorted, bool is_one_sample,
                       bool with_bootstrap) {
  return {.name = name,
          .episodes = static_cast<int>(sorted.size()),
          .mean = Mean(sorted),
          .std = is_one_sample ? kNaN : StandardDeviation(sorted),
          .median = Quantile(sorted, 0.5),
          .p5 = Quantile(sorted, 0.05),
          .p95 = Quantile(sorted, 0.95),
          .min = sorted.front(),
          .max = sorted.back(),
          .mean_95 = with_bootstrap && !is_one_sample ? MeanInterval(name, sorted) : kNoInterval};
}

// Returns an empty object if the key is missing.
const ordered_json& Member(const ordered_json& json, const char* key) {
  static const ordered_json kNone = ordered_json::object();
  const auto found = json.find(key);
  return found == json.end() ? kNone : *found;
}

constexpr const char* kPoseKeys[] = {"x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"};

NamedPoses PosesOf(const ordered_json& json) {
  NamedPoses poses;
  for (const auto& [name, value] : json.items()) {
    Pose& pose = poses.emplace_back(Interned(name), Pose{}).second;
    for (size_t k = 0; k < 3; ++k) value.at(kPoseKeys[k]).get_to(pose.position[k]);
    for (size_t k = 0; k < 4; ++k) value.at(kPoseKeys[3 + k]).get_to(pose.quaternion[k]);
  }
  return poses;
}

// key: key of the episode that contains the index.
int IndexIn(const char* key, const std::string& text) {
  if (const auto index = NumberFrom<int>(text)) return *index;
  throw InputError(std::string(key) + ": expected a whole number, got '" + text + "'");
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
  const ordered_json& metrics = episode.at("metrics");
  EpisodeResult result{.complete = episode.at("complete").get<bool>(),
                       .invalid = episode.at("end_reason") == end_reason::kServerError,
                       .success = metrics.value(kSuccess, 0.0) == 1,
                       .failure_reason = episode.at("failure_reason").get<std::string>(),
                       .values = NumbersOf(metrics, episode.at("extended")),
                       .parameters = FlattenedValues(Member(episode, "parameters")),
                       .is_start_known = episode.contains("parameters"),
                       .final_poses = PosesOf(Member(episode, "final_poses"))};
  if (const auto seen = episode.find(kSeenInTraining); seen != episode.end())
    result.seen_in_training = seen->get<bool>();
  const bool is_decided = result.success || episode.at("end_reason") == end_reason::kFailure;
  const ordered_json& conditions = Member(Member(episode, "explanation"), "conditions");
  result.decided_at_start = is_decided && !conditions.empty() && conditions[0].value("tick", 2) <= 1;
  const ordered_json& stages = Member(metrics, kStages);
  for (const auto& [index, reached] : stages.items()) {
    result.stages.emplace_back(IndexIn(kStages, index), reached.get<bool>());
  }
  const ordered_json& slips = Member(metrics, kSlips);
  for (const auto& [object, count] : slips.items()) {
    // Keys are "object_1", "object_2", ... If the key of a lower number is missing, that value is unknown
    // (-1).
    const int number = object.starts_with(kObject) ? IndexIn(kSlips, object.substr(sizeof kObject - 1)) : 0;
    if (number < 1 || number > kMaxObjects)
      throw InputError(std::string(kSlips) + ": unknown key '" + object + "'");
    result.slips.resize(std::max(result.slips.size(), static_cast<size_t>(number)), -1);
    result.slips[static_cast<size_t>(number) - 1] = count.get<int64_t>();
  }
  Member(Member(episode, "explanation"), "collisions_per_geom").get_to(result.collisions);
  return result;
}

ordered_json PosesJson(const NamedPoses& poses) {
  ordered_json json = ordered_json::object();
  for (const auto& [name, pose] : poses) {
    ordered_json& values = json[std::string(name)];
    for (size_t k = 0; k < 3; ++k) values[kPoseKeys[k]] = pose.position[k];
    for (size_t k = 0; k < 4; ++k) values[kPoseKeys[3 + k]] = pose.quaternion[k];
  }
  return json;
}

NamedNumbers NumbersOf(const ordered_json& metrics, const ordered_json& extended) {
  NamedNumbers values;
  for (const auto& [key, value] : metrics.items()) {
    if (key != kSuccess && key != kStages) Flatten(value, key, &values);
  }
  Flatten(extended, "extended", &values);
  return values;
}

NamedNumbers FlattenedValues(const ordered_json& metrics, const std::string& before) {
  NamedNumbers values;
  Flatten(metrics, before, &values);
  return values;
}

std::optional<double> EpisodeResult::Find(std::string_view name) const {
  const auto found = std::ranges::find(
      values, name, [](const auto& named) -> const auto& { return named.first; });
  return found == values.end() ? std::nullopt : std::optional(found->second);
}

double RunSummary::InSamples(int count) const {
  return samples == complete ? count : static_cast<double>(count) * samples / complete;
}

std::string RunSummary::SamplesText() const {
  if (samples == complete) return "";
  if (samples == 1) {
    return "all " + std::to_string(complete) +
           " episodes have equal starts and equal numbers: the interval counts them as one";
  }
  return "the interval counts " + std::to_string(samples) + " episodes instead of " +
         std::to_string(complete) +
         ": a task whose episodes all have equal starts and equal numbers counts as one";
}

std::string RunSummary::TrainingText() const {
  if (!seen_in_training || complete == 0) return "";
  return std::to_string(*seen_in_training) + " of " + std::to_string(complete) +
         (complete == 1 ? " start was" : " starts were") + " seen in training";
}

std::string RunSummary::StartText() const {
  if (decided_at_start == 0) return "";
  return std::to_string(decided_at_start) + " of " + std::to_string(judged) +
         (judged == 1 ? " episode was" : " episodes were") +
         " decided at the first tick: success or failure is true at the start, whatever the policy does";
}

std::string RunSummary::ActionsText() const {
  constexpr int kNotedPerSecond = 1;
  std::string text;
  const auto add = [&](const char* metric, const char* what) {
    const MetricSummary* const count = Find(metric);
    const double per_s = count && simulated_s > 0 ? count->mean * count->episodes / simulated_s : 0;
    if (!(per_s >= kNotedPerSecond)) return;
    text += (text.empty() ? "" : "; ") + std::to_string(std::lround(per_s)) + what;
  };
  add("extended.action_clips",
      " commanded values per second were clipped to their limits: is the unit or scale wrong?");
  add("extended.unreachable_poses",
      " commanded wrist poses per second were out of reach: is the frame or unit wrong?");
  return text;
}

std::vector<std::string> RunSummary::Notes() const {
  std::vector<std::string> notes = {StartText(), ActionsText(), SamplesText(), TrainingText()};
  std::erase(notes, "");
  return notes;
}

std::string RunSummary::StagesText() const {
  if (successes_without_stage == 0) return "";
  return std::to_string(successes_without_stage) + " of " + std::to_string(successes) +
         (successes == 1 ? " success" : " successes") +
         " did not reach every stage: stages are not conditions of success";
}

const MetricSummary* RunSummary::Find(const std::string& metric) const {
  for (const MetricSummary& summary : metrics) {
    if (summary.name == metric) return &summary;
  }
  return nullptr;
}

size_t RunStatistics::Index(std::string_view name) {
  const size_t index = std::find(names_.begin(), names_.end(), name) - names_.begin();
  if (index == names_.size()) {
    names_.emplace_back(name);
    values_.emplace_back();
  }
  return index;
}

void RunStatistics::Values::Remove(double value) {
  Ascending();
  values_.erase(std::lower_bound(values_.begin(), values_.end(), value));
  --ascending_;
}

const std::vector<double>& RunStatistics::Values::Ascending() const {
  const auto added = values_.begin() + static_cast<std::ptrdiff_t>(ascending_);
  std::sort(added, values_.end());
  std::inplace_merge(values_.begin(), added, values_.end());
  ascending_ = values_.size();
  return values_;
}

void RunStatistics::Add(int episode, const EpisodeResult& result, int task) {
  Entry& entry = episodes_[episode];
  for (const auto& [index, value] : entry.numbers) values_[index].Remove(value);
  entry = {};
  entry.task = task;
  if (!result.complete) {
    entry.invalid = result.invalid;
    return;
  }
  static_cast<EpisodeResult&>(entry) = result;
  entry.values.clear();
  for (const auto& [name, value] : result.values) {
    if (IsOfSuccessesOnly(name)) entry.time_s = value;
    if (IsOfSuccessesOnly(name) && !result.success) continue;
    const size_t index = Index(name);
    entry.numbers.emplace_back(index, value);
    values_[index].Add(value);
  }
}

std::vector<StartRepeatability> RunStatistics::Repeatability() const {
  std::map<NamedNumbers, std::vector<const Entry*>> by_start;
  for (const auto& [number, episode] : episodes_) {
    if (episode.success && episode.is_start_known) by_start[episode.parameters].push_back(&episode);
  }
  std::vector<StartRepeatability> starts;
  for (const auto& [parameters, episodes] : by_start) {
    if (episodes.size() < kFewestToRepeat) continue;
    StartRepeatability start{parameters, static_cast<int>(episodes.size()), {}};
    for (const auto& [name, first] : episodes[0]->final_poses) {
      std::vector<Pose> poses;
      for (const Entry* episode : episodes) {
        for (const auto& [other, pose] : episode->final_poses) {
          if (other == name) poses.push_back(pose);
        }
      }
      if (poses.size() == episodes.size()) start.poses.emplace_back(name, RepeatabilityOf(poses));
    }
    if (!start.poses.empty()) starts.push_back(std::move(start));
  }
  return starts;
}

RunSummary RunStatistics::Summary(bool with_bootstrap) const {
  RunSummary summary;
  std::vector<std::pair<int, int>> stages;
  std::map<int, std::vector<const Entry*>> of_task;
  for (const auto& [number, episode] : episodes_) {
    ++summary.episodes;
    summary.invalid += episode.invalid;
    if (!episode.complete) continue;
    ++summary.complete;
    of_task[episode.task].push_back(&episode);
    summary.judged += episode.failure_reason != end_reason::kNotJudged;
    summary.successes += episode.success;
    summary.decided_at_start += episode.decided_at_start;
    summary.simulated_s += episode.time_s;
    summary.successes_without_stage +=
        episode.success &&
        std::ranges::any_of(episode.stages, [](const auto& stage) { return !stage.second; });
    if (episode.seen_in_training)
      summary.seen_in_training = summary.seen_in_training.value_or(0) + *episode.seen_in_training;
    if (!episode.success) Count(episode.failure_reason, 1, &summary.failure_reasons);
    for (const auto& [index, reached] : episode.stages) Count(index, int{reached}, &stages);
    std::vector<int64_t>& slips = summary.slips_per_object;
    slips.resize(std::max(slips.size(), episode.slips.size()));
    for (size_t k = 0; k < episode.slips.size(); ++k) {
      slips[k] = slips[k] < 0 || episode.slips[k] < 0 ? -1 : slips[k] + episode.slips[k];
    }
    for (const auto& [geom, count] : episode.collisions) Count(geom, count, &summary.collisions_per_geom);
  }
  for (const auto& [task, entries] : of_task) summary.samples += NumSamples(entries);
  for (const auto& [index, reached] : stages) summary.stages.push_back({index, reached});
  MostFrequentFirst(&summary.failure_reasons);
  MostFrequentFirst(&summary.collisions_per_geom);
  summary.success_rate = summary.judged > 0 ? static_cast<double>(summary.successes) / summary.judged : kNaN;
  const double successes = summary.InSamples(summary.successes), trials = summary.InSamples(summary.judged);
  summary.wilson = WilsonInterval(successes, trials);
  summary.clopper_pearson = ClopperPearsonInterval(successes, trials);
  summary.anytime = ConfidenceSequence(successes, trials);
  for (size_t i = 0; i < names_.size(); ++i) {
    const std::vector<double>& values = values_[i].Ascending();
    if (!values.empty())
      summary.metrics.push_back(Describe(names_[i], values, summary.samples == 1, with_bootstrap));
  }
  if (with_bootstrap && summary.samples > 1) summary.repeatability = Repeatability();
  return summary;
}

run_summary_t SummaryMessage(const RunSummary& summary) {
  run_summary_t message{};
  message.num_episodes = summary.episodes;
  message.num_complete = summary.complete;
  message.num_success = summary.successes;
  message.success_rate = summary.success_rate;
  message.success_rate_anytime_lower = summary.anytime.lower;
  message.success_rate_anytime_upper = summary.anytime.upper;
  message.success_rate_wilson_lower = summary.wilson.lower;
  message.success_rate_wilson_upper = summary.wilson.upper;
  message.success_rate_clopper_pearson_lower = summary.clopper_pearson.lower;
  message.success_rate_clopper_pearson_upper = summary.clopper_pearson.upper;
  message.num_stages = static_cast<int32_t>(summary.stages.size());
  for (const StageSummary& stage : summary.stages) {
    message.stage_index.push_back(stage.index);
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

ordered_json RatesJson(const RunSummary& summary) {
  ordered_json json = {{"episodes", summary.episodes}, {"complete", summary.complete}};
  if (summary.invalid > 0) json["invalid"] = summary.invalid;
  if (summary.samples < summary.complete) json["samples"] = summary.samples;
  if (summary.judged < summary.complete) json["judged"] = summary.judged;
  json["successes"] = summary.successes;
  json["success_rate"] = summary.success_rate;
  json["success_rate_wilson_95"] = Json(summary.wilson);
  if (summary.seen_in_training) json[kSeenInTraining] = *summary.seen_in_training;
  return json;
}

std::vector<std::string> RunSummary::NotesWithStages() const {
  std::vector<std::string> notes = Notes();
  if (const std::string stages = StagesText(); !stages.empty()) notes.push_back(stages);
  return notes;
}

ordered_json SummaryJson(const std::string& task, const std::string& variation, const RunSummary& summary) {
  ordered_json json = {{"task", task}, {"variation", variation}};
  json.update(RatesJson(summary));
  json["success_rate_clopper_pearson_95"] = Json(summary.clopper_pearson);
  if (const std::vector<std::string> notes = summary.NotesWithStages(); !notes.empty()) json["notes"] = notes;
  ordered_json& stages = json["stages"] = ordered_json::object();
  for (const StageSummary& stage : summary.stages) {
    stages[std::to_string(stage.index)] = {
        {"reached", stage.reached},
        {"share", static_cast<double>(stage.reached) / summary.complete},
        {"share_wilson_95", Json(WilsonInterval(summary.InSamples(stage.reached), summary.samples))}};
  }
  json["failure_reasons"] = Json(summary.failure_reasons);
  ordered_json& slips = json["slips_per_object"] = ordered_json::object();
  for (size_t k = 0; k < summary.slips_per_object.size(); ++k) {
    if (summary.slips_per_object[k] < 0) continue;
    slips[kObject + std::to_string(k + 1)] = summary.slips_per_object[k];
  }
  json["collisions_per_geom"] = Json(summary.collisions_per_geom);
  ordered_json& metrics = json["metrics"] = ordered_json::object();
  for (const MetricSummary& metric : summary.metrics) {
    // Statistics that are undefined for one episode (NaN) become null.
    metrics[metric.name] = {
        {"episodes", metric.episodes}, {"mean", metric.mean},     {"mean_95", Json(metric.mean_95)},
        {"std", metric.std},           {"median", metric.median}, {"p5", metric.p5},
        {"p95", metric.p95},           {"min", metric.min},       {"max", metric.max}};
  }
  for (const StartRepeatability& start : summary.repeatability) {
    ordered_json& entry = json["repeatability"].emplace_back();
    entry["parameters"] = ordered_json::object();
    for (const auto& [name, value] : start.parameters) entry["parameters"][std::string(name)] = value;
    entry["episodes"] = start.episodes;
    for (const auto& [name, pose] : start.poses) {
      entry["poses"][std::string(name)] = {{"position_m", pose.position}, {"rotation_rad", pose.rotation}};
    }
  }
  return json;
}

}  // namespace evalbus::metrics
