#include "results/comparison_json.h"

#include <optional>

#include "results/conclusion.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

ordered_json Json(const metrics::Interval& interval) { return {interval.lower, interval.upper}; }

ordered_json Json(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

const char* BetterWord(Better better) {
  return better == Better::kLower ? "lower" : better == Better::kHigher ? "higher" : "neither";
}

ordered_json Json(const MetricComparison& metric, bool paired) {
  ordered_json json = {
      {"over", metric.number.metric->effort ? (paired ? "pairs in which both succeeded" : "successes")
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
    json["ratio_of"] = paired && metric.number.metric->effort ? "pairs" : "means";
    json["ratio"] = *metric.ratio;
    json["ratio_95"] = Json(metric.ratio_95);
  }
  return json;
}

const char* TestWord(SuccessTest test) {
  switch (test) {
    case SuccessTest::kMcNemar:
      return "McNemar, exact";
    case SuccessTest::kFisher:
      return "Fisher, exact";
    case SuccessTest::kSequentialMcNemar:
      break;
  }
  return "McNemar, valid at any look";
}

ordered_json Json(const ComparedRuns& runs) {
  return {{"name", runs.name}, {"folder", runs.folder}, {"policy", runs.policy}};
}

}  // namespace

ordered_json SuccessJson(const SuccessComparison& success) {
  const auto known = [&](double value) { return success.has_both_sides() ? ordered_json(value) : nullptr; };
  ordered_json json = {
      {"successes", success.successes},
      {"episodes", success.trials},
      {"baseline_successes", success.baseline_successes},
      {"baseline_episodes", success.baseline_trials},
      {"difference", known(success.difference)},
      {"difference_95", {known(success.difference_95.lower), known(success.difference_95.upper)}},
      {"interval", success.paired ? "Newcombe, paired" : "Newcombe"},
      {"test", TestWord(success.test)},
      {"samples", success.samples.trials},
      {"baseline_samples", success.samples.baseline_trials},
      {"p", known(success.p)},
      {"p_holm", known(success.p_adjusted)}};
  // The power of the test of a plan with `until` depends on the plan's looks.
  const bool has_outlook = success.test != SuccessTest::kSequentialMcNemar;
  if (has_outlook && success.has_both_sides()) {
    const Outlook outlook = OutlookOf(success);
    json["findable_difference"] = Json(outlook.findable);
    json["episodes_needed"] = outlook.needed ? ordered_json(*outlook.needed) : ordered_json();
  }
  if (success.paired) {
    json["pairs"] = {{"both", success.pairs.both},
                     {"run_only", success.pairs.only_a},
                     {"baseline_only", success.pairs.only_b},
                     {"neither", success.pairs.neither}};
  }
  return json;
}

ordered_json ComparisonJson(const std::vector<Comparison>& comparisons,
                            const std::vector<RankedRun>& ranking) {
  ordered_json json = {{"baseline", Json(comparisons.front().baseline)},
                       {"comparisons", ordered_json::array()}};
  if (!comparisons.front().on.empty()) json["on"] = comparisons.front().on;
  for (const RankedRun& run : ranking) {
    json["ranking"].push_back({{"name", run.name},
                               {"successes", run.successes},
                               {"episodes", run.trials},
                               {"letters", run.letters}});
  }
  for (const Comparison& comparison : comparisons) {
    ordered_json one = Json(comparison.run);
    one["verdict"] = Conclusion(comparison);
    one["success"] = SuccessJson(comparison.success);
    one["remarks"] = comparison.remarks;
    one["tasks"] = ordered_json::array();
    for (const TaskComparison& task : comparison.tasks) {
      ordered_json entry = {{"task", task.task},
                            {"variation", task.variation},
                            {"baseline_variation", task.baseline_variation},
                            {"paired", task.paired},
                            {"unmatched", task.unmatched},
                            {"baseline_unmatched", task.baseline_unmatched},
                            {"success", SuccessJson(task.success)}};
      entry["flipped"] = ordered_json::array();
      for (const ComparedPair& pair : task.flipped()) {
        entry["flipped"].push_back({{"seed", pair.seed},
                                    {"episode", pair.run.episode},
                                    {"baseline_episode", pair.baseline.episode},
                                    {"succeeded", pair.run.success ? "run" : "baseline"},
                                    {"failure_reason", pair.failed().failure_reason}});
      }
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
