#include "cli/results/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/errors.h"
#include "base/run_layout.h"
#include "metrics/statistics/bootstrap.h"
#include "metrics/statistics/fisher.h"
#include "metrics/statistics/holm.h"
#include "metrics/statistics/mann_whitney.h"
#include "metrics/statistics/mcnemar.h"
#include "metrics/statistics/wilcoxon.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

// Metrics of an episode by name.
using Values = std::map<std::string, double>;

struct Scored {
  const RecordedEpisode* episode;
  Values values;
};

std::map<int64_t, Scored> CompleteBySeed(const RecordedRun& run) {
  std::map<int64_t, Scored> scored;
  for (const RecordedEpisode& episode : run.episodes) {
    if (!episode.complete) continue;
    const auto values = episode.Values();
    scored[episode.seed] = {&episode, {values.begin(), values.end()}};
  }
  return scored;
}

// What makes values of two runs comparable.
void CheckComparable(const RecordedRun& run, const RecordedRun& baseline) {
  const auto value = [](const RecordedRun& of, const char* key) {
    const auto found = of.info.find(key);
    if (found == of.info.end()) {
      throw InputError((of.folder / kRunJson).string() + ": no \"" + key +
                       "\", without which this run cannot be compared");
    }
    return *found;
  };
  const ordered_json rate = value(run, "control_hz"), baseline_rate = value(baseline, "control_hz");
  if (rate != baseline_rate) {
    throw InputError(
        fmt::format("{} ran at {} Hz and {} at {} Hz: values depend on the control rate, so these runs "
                    "cannot be compared",
                    run.name, rate.dump(), baseline.name, baseline_rate.dump()));
  }
  for (const auto& [key, what] : {std::pair("task_sha256", "descriptions of the task"),
                                  {"physics_sha256", "physics models (scene, robot or physics step)"}}) {
    if (value(run, key) == value(baseline, key)) continue;
    throw InputError(fmt::format("{} and {} were made with different {}, so these runs cannot be compared",
                                 run.name, baseline.name, what));
  }
}

// p and interval of a metric from its values.
void TestPaired(const std::vector<double>& values, const std::vector<double>& baseline,
                MetricComparison* metric) {
  std::vector<double> differences;
  for (size_t i = 0; i < values.size(); ++i) differences.push_back(values[i] - baseline[i]);
  metric->difference = metrics::Mean(differences);
  metric->difference_95 = metrics::BootstrapMean(differences);
  if (std::any_of(differences.begin(), differences.end(), [](double d) { return d != 0; })) {
    metric->p = metrics::WilcoxonSignedRankTest(differences).p;
  }
  if (metric->number.metric->effort && metric->baseline_mean > 0) {
    metric->ratio = metric->mean / metric->baseline_mean;
    metric->ratio_95 = metrics::BootstrapRatioOfMeans(values, baseline);
  }
}

void TestUnpaired(const std::vector<double>& values, const std::vector<double>& baseline,
                  MetricComparison* metric) {
  metric->difference = metric->mean - metric->baseline_mean;
  metric->difference_95 = metrics::BootstrapDifferenceOfMeans(values, baseline);
  const auto differs = [&](double value) { return value != baseline[0]; };
  if (std::any_of(values.begin(), values.end(), differs) ||
      std::any_of(baseline.begin(), baseline.end(), differs)) {
    metric->p = metrics::MannWhitneyTest(values, baseline).p;
  }
}

// The main metrics that any of the episodes has.
std::vector<MetricNumber> MainMetricsOf(const std::map<int64_t, Scored>& run,
                                        const std::map<int64_t, Scored>& baseline) {
  std::set<std::string> names;
  for (const auto* episodes : {&run, &baseline}) {
    for (const auto& [seed, scored] : *episodes) {
      for (const auto& [name, value] : scored.values) names.insert(name);
    }
  }
  return MainMetrics({names.begin(), names.end()});
}

std::vector<MetricComparison> CompareMetrics(const std::map<int64_t, Scored>& run,
                                             const std::map<int64_t, Scored>& baseline, bool paired) {
  std::vector<MetricComparison> metrics;
  for (const MetricNumber& number : MainMetricsOf(run, baseline)) {
    const auto value = [&](const Scored& scored) -> std::optional<double> {
      const auto found = scored.values.find(number.name);
      const bool counts = !number.metric->effort || scored.episode->success;
      return found == scored.values.end() || !counts ? std::nullopt : std::optional(found->second);
    };
    std::vector<double> values, baseline_values;
    for (const auto& [seed, scored] : run) {
      const auto own = value(scored);
      if (!own) continue;
      if (paired) {
        const auto other = value(baseline.at(seed));
        if (!other) continue;
        baseline_values.push_back(*other);
      }
      values.push_back(*own);
    }
    for (const auto& [seed, scored] : baseline) {
      const auto own = paired ? std::nullopt : value(scored);
      if (own) baseline_values.push_back(*own);
    }
    if (values.empty() || baseline_values.empty()) continue;
    MetricComparison metric{.number = number,
                            .count = static_cast<int>(values.size()),
                            .baseline_count = static_cast<int>(baseline_values.size()),
                            .mean = metrics::Mean(values),
                            .baseline_mean = metrics::Mean(baseline_values),
                            .difference = 0,
                            .difference_95 = {},
                            .p = std::nullopt,
                            .p_holm = 1,
                            .ratio = std::nullopt,
                            .ratio_95 = {}};
    (paired ? TestPaired : TestUnpaired)(values, baseline_values, &metric);
    metrics.push_back(metric);
  }
  std::vector<double> p;
  for (const MetricComparison& metric : metrics) {
    if (metric.p) p.push_back(*metric.p);
  }
  const std::vector<double> adjusted = metrics::HolmAdjusted(p);
  for (size_t i = 0, k = 0; i < metrics.size(); ++i) {
    if (metrics[i].p) metrics[i].p_holm = adjusted[k++];
  }
  return metrics;
}

TaskComparison CompareTask(const RecordedRun& run, const RecordedRun& baseline) {
  CheckComparable(run, baseline);
  TaskComparison result{.task = run.task,
                        .variation = run.variation,
                        .baseline_variation = baseline.variation,
                        .paired = false,
                        .unmatched = 0,
                        .baseline_unmatched = 0,
                        .success = {},
                        .metrics = {}};
  auto own = CompleteBySeed(run), other = CompleteBySeed(baseline);
  const auto partner = [](const auto& in) {
    return [&in](const auto& entry) { return in.contains(entry.first); };
  };
  result.paired = run.variation == baseline.variation && std::any_of(own.begin(), own.end(), partner(other));
  if (result.paired) {
    const auto drop = [&](auto* from, const auto& in) {
      return static_cast<int>(std::erase_if(*from, [&](const auto& entry) { return !partner(in)(entry); }));
    };
    result.unmatched = drop(&own, other);
    result.baseline_unmatched = drop(&other, own);
  }
  SuccessComparison& success = result.success;
  success.paired = result.paired;
  for (const auto& [seed, scored] : own) {
    ++success.trials;
    success.successes += scored.episode->success;
    if (!result.paired) continue;
    const bool a = scored.episode->success, b = other.at(seed).episode->success;
    ++(a && b ? success.pairs.both
       : a    ? success.pairs.only_a
       : b    ? success.pairs.only_b
              : success.pairs.neither);
  }
  for (const auto& [seed, scored] : other) {
    ++success.baseline_trials;
    success.baseline_successes += scored.episode->success;
  }
  success.Test();
  result.metrics = CompareMetrics(own, other, result.paired);
  return result;
}

ComparedRuns About(const RecordedRuns& runs) {
  return {runs.name, runs.folder.string(), runs.runs.front().policy};
}

void AddRemarks(const RecordedRuns& runs, std::vector<std::string>* remarks) {
  for (const RecordedRun& run : runs.runs) {
    for (const std::string& remark : run.Remarks()) remarks->push_back(run.name + ": " + remark);
  }
}

ordered_json Json(const metrics::Interval& interval) { return {interval.lower, interval.upper}; }

ordered_json Json(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json Json(const SuccessComparison& success) {
  ordered_json json = {{"successes", success.successes},
                       {"episodes", success.trials},
                       {"baseline_successes", success.baseline_successes},
                       {"baseline_episodes", success.baseline_trials},
                       {"difference", success.difference},
                       {"difference_95", Json(success.difference_95)},
                       {"interval", success.paired ? "Newcombe, paired" : "Newcombe"},
                       {"test", success.paired ? "McNemar, exact" : "Fisher, exact"},
                       {"p", success.p},
                       {"p_holm", success.p_holm},
                       {"detectable_difference", Json(success.detectable)}};
  if (success.paired) {
    json["pairs"] = {{"both", success.pairs.both},
                     {"run_only", success.pairs.only_a},
                     {"baseline_only", success.pairs.only_b},
                     {"neither", success.pairs.neither}};
  }
  return json;
}

const char* BetterWord(Better better) {
  return better == Better::kLower ? "lower" : better == Better::kHigher ? "higher" : "neither";
}

ordered_json Json(const MetricComparison& metric, bool paired) {
  ordered_json json = {
      {"over", metric.number.metric->effort ? (paired ? "pairs that both succeeded" : "successes")
                                            : (paired ? "all pairs" : "all episodes")},
      {"count", metric.count},
      {"baseline_count", metric.baseline_count},
      {"mean", metric.mean},
      {"baseline_mean", metric.baseline_mean},
      {"difference", metric.difference},
      {"difference_95", Json(metric.difference_95)},
      {"test", paired ? "Wilcoxon signed-rank" : "Mann-Whitney"},
      {"p", Json(metric.p)},
      {"p_holm", metric.p ? ordered_json(metric.p_holm) : ordered_json()},
      {"better", BetterWord(metric.number.metric->better)}};
  if (metric.ratio) {
    json["ratio"] = *metric.ratio;
    json["ratio_95"] = Json(metric.ratio_95);
  }
  return json;
}

ordered_json Json(const ComparedRuns& runs) {
  return {{"name", runs.name}, {"folder", runs.folder}, {"policy", runs.policy}};
}

}  // namespace

const char* Word(Judgement judgement) {
  switch (judgement) {
    case Judgement::kBetter:
      return "better";
    case Judgement::kWorse:
      return "worse";
    case Judgement::kDiffers:
      return "differs";
    case Judgement::kNone:
      break;
  }
  return "";
}

void SuccessComparison::Add(const SuccessComparison& other) {
  successes += other.successes;
  trials += other.trials;
  baseline_successes += other.baseline_successes;
  baseline_trials += other.baseline_trials;
  pairs.both += other.pairs.both;
  pairs.only_a += other.pairs.only_a;
  pairs.only_b += other.pairs.only_b;
  pairs.neither += other.pairs.neither;
}

Judgement SuccessComparison::judgement() const {
  if (p_holm >= metrics::kAlpha) return Judgement::kNone;
  return difference > 0 ? Judgement::kBetter : Judgement::kWorse;
}

Judgement MetricComparison::judgement() const {
  if (!differs()) return Judgement::kNone;
  const bool is_up = difference_95.lower > 0, is_down = difference_95.upper < 0;
  const Better better = number.metric->better;
  if (better == Better::kNeither || !(is_up || is_down)) return Judgement::kDiffers;
  return is_up == (better == Better::kHigher) ? Judgement::kBetter : Judgement::kWorse;
}

void SuccessComparison::Test() {
  if (trials == 0 || baseline_trials == 0) {
    difference_95 = {-1, 1};
    return;
  }
  const double baseline_rate = static_cast<double>(baseline_successes) / baseline_trials;
  difference = static_cast<double>(successes) / trials - baseline_rate;
  if (paired) {
    difference_95 = metrics::NewcombePairedInterval(pairs);
    p = metrics::McNemarTest(pairs.only_a, pairs.only_b);
    const int against = std::min(pairs.only_a, pairs.only_b);
    for (int more = 1; against * 2 + more <= trials && !detectable; ++more) {
      if (metrics::McNemarTest(against + more, against) < metrics::kAlpha)
        detectable = static_cast<double>(more) / trials;
    }
  } else {
    difference_95 = metrics::NewcombeInterval(successes, trials, baseline_successes, baseline_trials);
    p = metrics::FisherTest(successes, trials, baseline_successes, baseline_trials);
    for (int k = 0; k <= trials; ++k) {
      const double apart = std::abs(static_cast<double>(k) / trials - baseline_rate);
      if (metrics::FisherTest(k, trials, baseline_successes, baseline_trials) < metrics::kAlpha)
        detectable = std::min(detectable.value_or(1), apart);
    }
  }
  p_holm = p;
}

Comparison CompareRuns(const RecordedRuns& run, const RecordedRuns& baseline) {
  Comparison result{
      .run = About(run), .baseline = About(baseline), .tasks = {}, .success = {}, .remarks = {}};
  const bool single = run.runs.size() == 1 && baseline.runs.size() == 1;
  for (const RecordedRun& own : run.runs) {
    const auto other =
        std::find_if(baseline.runs.begin(), baseline.runs.end(), [&](const RecordedRun& candidate) {
          return candidate.task == own.task && (single || candidate.variation == own.variation);
        });
    if (other == baseline.runs.end()) {
      result.remarks.push_back(fmt::format("{} is not in {}: left out", own.task_name(), baseline.name));
      continue;
    }
    result.tasks.push_back(CompareTask(own, *other));
  }
  if (result.tasks.empty()) {
    throw InputError(fmt::format("{} ({}) and {} ({}) have no task in common", run.name,
                                 run.runs[0].task_name(), baseline.name, baseline.runs[0].task_name()));
  }
  for (const RecordedRun& other : baseline.runs) {
    const bool used = std::any_of(result.tasks.begin(), result.tasks.end(), [&](const TaskComparison& task) {
      return task.task == other.task && task.baseline_variation == other.variation;
    });
    if (!used) {
      result.remarks.push_back(fmt::format("{} is not in {}: left out", other.task_name(), run.name));
    }
  }
  result.success.paired = std::all_of(result.tasks.begin(), result.tasks.end(),
                                      [](const TaskComparison& task) { return task.paired; });
  std::vector<double> p;
  for (const TaskComparison& task : result.tasks) {
    result.success.Add(task.success);
    p.push_back(task.success.p);
    if (task.unmatched + task.baseline_unmatched > 0) {
      result.remarks.push_back(fmt::format("{}/{}: {} episodes of {} and {} of {} have no partner: left out",
                                           task.task, task.variation, task.unmatched, run.name,
                                           task.baseline_unmatched, baseline.name));
    }
    if (!task.paired) {
      result.remarks.push_back(
          task.variation != task.baseline_variation
              ? fmt::format("{}: {} has variation {}, {} has {}: compared as independent samples", task.task,
                            run.name, task.variation, baseline.name, task.baseline_variation)
              : fmt::format("{}/{}: no seed in common: compared as independent samples", task.task,
                            task.variation));
    }
  }
  result.success.Test();
  const std::vector<double> adjusted = metrics::HolmAdjusted(p);
  for (size_t i = 0; i < adjusted.size(); ++i) result.tasks[i].success.p_holm = adjusted[i];
  AddRemarks(baseline, &result.remarks);
  AddRemarks(run, &result.remarks);
  return result;
}

std::vector<Comparison> CompareAll(const std::vector<RecordedRuns>& runs, const RecordedRuns& baseline) {
  std::vector<Comparison> comparisons;
  std::vector<double> p;
  for (const RecordedRuns& run : runs) {
    comparisons.push_back(CompareRuns(run, baseline));
    p.push_back(comparisons.back().success.p);
  }
  const std::vector<double> adjusted = metrics::HolmAdjusted(p);
  for (size_t i = 0; i < adjusted.size(); ++i) comparisons[i].success.p_holm = adjusted[i];
  return comparisons;
}

std::string Conclusion(const Comparison& comparison) {
  const SuccessComparison& success = comparison.success;
  const std::string &run = comparison.run.name, &baseline = comparison.baseline.name;
  if (success.trials == 0 || success.baseline_trials == 0) {
    return fmt::format("Nothing can be said: {} has no complete episode.",
                       success.trials == 0 ? run : baseline);
  }
  const bool shown = success.p_holm < metrics::kAlpha;
  const std::string counts = fmt::format("{} of {} against {} of {}{}", success.successes, success.trials,
                                         success.baseline_successes, success.baseline_trials,
                                         success.paired ? " on the same seeds" : "");
  std::string test = success.paired ? "exact McNemar" : "Fisher's exact test";
  if (success.p_holm != success.p) test += ", adjusted by Holm,";
  const std::string p =
      success.p_holm < 0.001 ? test + " p < 0.001" : fmt::format("{} p = {:.2g}", test, success.p_holm);
  const std::string numbers = fmt::format("{}, difference {:.0f} points (95 % interval {:.0f} to {:.0f}), {}",
                                          counts, success.difference * 100, success.difference_95.lower * 100,
                                          success.difference_95.upper * 100, p);
  if (shown) {
    return fmt::format("{} succeeds {} often than {}: {}.", run, success.difference > 0 ? "more" : "less",
                       baseline, numbers);
  }
  const std::string what = success.paired
                               ? fmt::format("{} pairs", success.trials)
                               : fmt::format("{} and {} episodes", success.trials, success.baseline_trials);
  const std::string limit =
      success.detectable ? fmt::format("{} like these can only show differences from about {:.0f} points on",
                                       what, *success.detectable * 100)
                         : fmt::format("{} are too few to show any difference", what);
  return fmt::format("No difference shown between {} and {}: {}; {}.", run, baseline, numbers, limit);
}

ordered_json ComparisonJson(const std::vector<Comparison>& comparisons) {
  ordered_json json = {{"baseline", Json(comparisons.front().baseline)},
                       {"comparisons", ordered_json::array()}};
  for (const Comparison& comparison : comparisons) {
    ordered_json one = Json(comparison.run);
    one["verdict"] = Conclusion(comparison);
    one["success"] = Json(comparison.success);
    one["remarks"] = comparison.remarks;
    one["tasks"] = ordered_json::array();
    for (const TaskComparison& task : comparison.tasks) {
      ordered_json entry = {{"task", task.task},
                            {"variation", task.variation},
                            {"baseline_variation", task.baseline_variation},
                            {"paired", task.paired},
                            {"unmatched", task.unmatched},
                            {"baseline_unmatched", task.baseline_unmatched},
                            {"success", Json(task.success)}};
      entry["metrics"] = ordered_json::object();
      for (const MetricComparison& metric : task.metrics)
        entry["metrics"][metric.number.name] = Json(metric, task.paired);
      one["tasks"].push_back(std::move(entry));
    }
    json["comparisons"].push_back(std::move(one));
  }
  return json;
}

}  // namespace evalbus::results
