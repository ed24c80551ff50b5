#include "results/gate_metric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "base/errors.h"
#include "base/number_from.h"
#include "base/suggestion.h"
#include "metrics/statistics/bounds_of_mean.h"
#include "metrics/statistics/power.h"
#include "results/metric_choice.h"

namespace evalbus::results {
namespace {

// If all differences are equal, their variance cannot be estimated. With this number of equal pairs, at most
// 5 % of all starts deviate from this difference, with 95 % confidence, because 0.95^59 < 0.05.
constexpr int kEqualPairsNeeded = 59;
// With fewer differing pairs, the estimate of their variance is too uncertain.
constexpr int kDifferingPairsNeeded = 10;

std::optional<double> ValueOf(const RecordedEpisode& episode, const MetricNumber& number) {
  const bool counts = episode.success || !number.metric->effort;
  return counts ? episode.Find(number.name) : std::nullopt;
}

// Parses a margin such as "0.2" or "10%".
GateMargin ParseMargin(const std::string& text, const std::string& option) {
  const bool is_percent = text.ends_with('%');
  const auto value = NumberFrom<double>(text.substr(0, text.size() - is_percent));
  if (!value || !std::isfinite(*value) || *value < 0) {
    throw InputError(
        fmt::format("--on {}: margin '{}': expected a number in the metric's unit, such as 0.2, "
                    "or a percentage of the baseline, such as 10%",
                    option, text));
  }
  return {.value = *value, .is_percent = is_percent};
}

// Values of the pairs in which both episodes have a value.
struct PairedValues {
  std::vector<double> run, baseline;
};

PairedValues ValuesOf(const MetricNumber& number, const EpisodePairs& pairs) {
  PairedValues values;
  for (const auto& [episode, other] : pairs) {
    const auto value = ValueOf(*episode, number), baseline = ValueOf(*other, number);
    if (!value || !baseline) continue;
    values.run.push_back(*value);
    values.baseline.push_back(*baseline);
  }
  return values;
}

GateVerdict VerdictOn(const GateCriterion& bounds) {
  if (bounds.loss_upper < bounds.margin) return GateVerdict::kPass;
  if (bounds.loss_lower > bounds.margin) return GateVerdict::kFail;
  return GateVerdict::kCannotTell;
}

// Returns the number of pairs that are needed to show with 80 % probability that the mean of these values is
// below or above 0.
std::optional<int> PairsNeeded(const std::vector<double>& x, double alpha) {
  const boost::math::normal_distribution<> normal;
  const double z = quantile(normal, 1 - alpha / 2) + quantile(normal, metrics::kWantedPower);
  const double needed = std::pow(z * metrics::StandardDeviation(x) / metrics::Mean(x), 2);
  if (!(needed < metrics::kMaxTrials)) return std::nullopt;
  return static_cast<int>(std::ceil(needed));
}

}  // namespace

std::vector<GateMetric> ParseGateMetrics(const std::vector<std::string>& on, const GateMargin& margin,
                                         const EpisodePairs& pairs) {
  std::set<std::string> available, baseline_available;
  for (const auto& [episode, other] : pairs) {
    for (const auto& [name, value] : episode->values) available.emplace(name);
    for (const auto& [name, value] : other->values) baseline_available.emplace(name);
  }
  std::erase_if(available, [&](const std::string& name) { return !baseline_available.contains(name); });
  std::vector<GateMetric> metrics;
  for (const std::string& option : on) {
    const size_t colon = std::min(option.find(':'), option.size());
    const std::string name = option.substr(0, colon);
    if (name == "success") {
      if (colon < option.size()) throw InputError("--on " + option + ": --margin is the margin of success");
      continue;
    }
    const std::vector<MetricNumber> found = FindNumbers(name, available);
    if (found.size() > 1) {
      std::vector<std::string> several;
      for (const MetricNumber& number : found) several.push_back(number.name);
      throw InputError("--on " + name + ": matches several metrics: " + ListOf(several));
    }
    GateMetric metric{found[0], margin};
    if (colon < option.size()) metric.margin = ParseMargin(option.substr(colon + 1), option);
    if (!metric.number.metric || metric.number.metric->better == Better::kNeither)
      throw InputError("--on " + option + ": neither higher nor lower values of this metric are better");
    if (metric.margin.is_percent && metric.number.metric->least < 0) {
      throw InputError(
          fmt::format("--on {}: values may be negative, so the margin cannot be in percent; "
                      "pass one in {}, such as {}:5",
                      option, metric.number.shown_unit(), name));
    }
    if (std::ranges::any_of(metrics,
                            [&](const GateMetric& other) { return other.number.name == metric.number.name; }))
      throw InputError("--on " + option + ": is given twice");
    metrics.push_back(metric);
  }
  return metrics;
}

GateCriterion DecideMetric(const GateMetric& metric, const EpisodePairs& pairs, double fail_alpha) {
  const MetricInfo& info = *metric.number.metric;
  const PairedValues values = ValuesOf(metric.number, pairs);
  const size_t n = values.run.size();
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  // A margin of a share, such as subtask progress, is in percentage points, unless it is relative.
  const std::string own_unit = info.shown_unit == "%" ? "points" : std::string(info.shown_unit);
  GateCriterion result{.what = metric.number.label(),
                       .verdict = GateVerdict::kCannotTell,
                       .pairs = static_cast<int>(n),
                       .pairs_are_successes = info.effort,
                       .baseline_mean = n > 0 ? metrics::Mean(values.baseline) * info.scale : kNone,
                       .mean = n > 0 ? metrics::Mean(values.run) * info.scale : kNone,
                       .mean_unit = std::string(info.shown_unit),
                       .loss = kNone,
                       .loss_lower = kNone,
                       .loss_upper = kNone,
                       .margin = metric.margin.value,
                       .unit = metric.margin.is_percent ? "%" : own_unit,
                       .fail_alpha = fail_alpha,
                       .more_pairs = std::nullopt,
                       .why = ""};
  if (n == 0) return result;
  // Losses are shown in this unit: percent of the baseline's mean, or the metric's unit.
  const double base = metrics::Mean(values.baseline);
  const double unit = metric.margin.is_percent ? std::abs(base) / 100 : 1 / info.scale;
  std::vector<double> losses, excesses;
  for (size_t i = 0; i < n; ++i) {
    const double loss = (info.better == Better::kLower ? 1 : -1) * (values.run[i] - values.baseline[i]);
    losses.push_back(loss);
    // A margin in percent refers to the baseline's value of each pair, so that the uncertainty of the
    // baseline's mean is included.
    const double allowed =
        metric.margin.value * (metric.margin.is_percent ? values.baseline[i] / 100 : 1 / info.scale);
    excesses.push_back(loss - allowed);
  }
  const double tie = metrics::kTie * metrics::LargestMagnitude(values.baseline);
  const auto differing =
      static_cast<int>(std::ranges::count_if(losses, [tie](double loss) { return std::abs(loss) > tie; }));
  const double mean = metrics::Mean(losses);
  if (unit == 0 && mean != 0) return result;  // a percentage of a baseline mean of 0 is undefined
  result.loss = mean == 0 ? 0 : mean / unit;
  const metrics::Interval pass = metrics::BoundsOfMean(excesses, metrics::kAlpha);
  const metrics::Interval fail = metrics::BoundsOfMean(excesses, fail_alpha);
  if (metrics::AreAllEqual(losses, metrics::kTie * metrics::LargestMagnitude(losses))) {
    if (static_cast<int>(n) < kEqualPairsNeeded) {
      result.more_pairs = kEqualPairsNeeded - static_cast<int>(n);
      return result;
    }
    result.loss_lower = result.loss_upper = result.loss;
    // A loss that equals the margin up to rounding passes, for example 0.9 - 0.7 with a margin of 0.2.
    result.verdict = mean - result.margin * unit > tie ? GateVerdict::kFail : GateVerdict::kPass;
    return result;
  }
  const auto needed = PairsNeeded(excesses, metrics::Mean(excesses) < 0 ? metrics::kAlpha : fail_alpha);
  if (differing < kDifferingPairsNeeded) {
    // From a single pair, nothing can be estimated. Pairs that are all equal are reduced to one.
    if (n > 1 && differing > 0 && needed) {
      // Enough pairs differ with a probability of about 80 % in this total. 0.84 is the 80 % quantile of the
      // normal distribution.
      const double enough = kDifferingPairsNeeded + 0.84 * std::sqrt(kDifferingPairsNeeded);
      const int total = static_cast<int>(std::ceil(static_cast<double>(n) * enough / differing));
      result.more_pairs = std::max(total, *needed) - static_cast<int>(n);
    }
    return result;
  }
  if (!std::isfinite(pass.upper) || unit == 0) return result;
  result.loss_upper = result.margin + pass.upper / unit;
  result.loss_lower = result.margin + fail.lower / unit;
  result.verdict = VerdictOn(result);
  if (result.verdict == GateVerdict::kCannotTell && needed)
    result.more_pairs = std::max(1, *needed - static_cast<int>(n));
  return result;
}

}  // namespace evalbus::results
