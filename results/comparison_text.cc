#include "results/comparison_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "base/percent.h"
#include "base/plural.h"
#include "base/styled_text.h"
#include "base/text.h"
#include "results/conclusion.h"

namespace evalbus::results {
namespace {

std::string FixedOrDash(double value, int decimals) {
  return std::isfinite(value) ? Fixed(value, decimals) : "-";
}

std::string Range(const metrics::Interval& interval, int decimals) {
  if (!std::isfinite(interval.lower)) return "-";
  return fmt::format("{:>8} to {:>8}", FixedOrDash(interval.lower, decimals),
                     FixedOrDash(interval.upper, decimals));
}

// Widths of the label column and of the value column of each side, in characters.
struct Widths {
  int label, side;
};

std::string Row(Widths widths, const std::string& label, const std::string& baseline, const std::string& run,
                const std::string& difference, const std::string& interval, const std::string& p,
                const std::string& holm, const std::string& verdict, bool colors) {
  const std::string line =
      fmt::format("{}  {}  {}  {:>9}  {:>21}  {:>6}  {:>6}", Pad(label, -widths.label),
                  Pad(baseline, widths.side), Pad(run, widths.side), difference, interval, p, holm);
  if (verdict.empty()) return line + "\n";
  const Style style = verdict == Word(Judgment::kBetter)  ? Style::kGood
                      : verdict == Word(Judgment::kWorse) ? Style::kBad
                                                          : Style::kQuiet;
  return line + "  " + Styled(verdict, style, colors) + "\n";
}

std::string Label(const MetricNumber& number) {
  const std::string unit(number.shown_unit());
  return number.label() + (number.metric->effort ? " *" : "") + (unit.empty() ? "" : ", " + unit);
}

Widths WidthsOf(int label, const Comparison& comparison) {
  constexpr int kLeast = 9, kMost = 16;
  return {label,
          std::clamp(std::max(Width(comparison.baseline.name), Width(comparison.run.name)), kLeast, kMost)};
}

// Shortens a name that is too long to its end, where names of checkpoints often differ.
std::string Short(const std::string& name, int width) {
  const int cut = Width(name) - width;
  return cut <= 0 ? name : ".." + name.substr(Cut(name, cut + 2).size());
}

std::string TitleRow(Widths widths, const std::string& label, const Comparison& comparison, bool colors) {
  return Row(widths, label, Short(comparison.baseline.name, widths.side),
             Short(comparison.run.name, widths.side), "difference", "95 % CI of difference", "p", "Holm", "",
             colors);
}

std::string SuccessRow(const std::string& label, Widths widths, const SuccessComparison& success,
                       bool colors) {
  const auto rate = [](int k, int n) { return Percent(static_cast<double>(k) / n); };
  return Row(widths, label, rate(success.baseline_successes, success.baseline_trials),
             rate(success.successes, success.trials), PercentagePoints(success.difference),
             fmt::format("{:>8} to {:>8}", PercentagePoints(success.difference_95.lower),
                         PercentagePoints(success.difference_95.upper)),
             PText(success.p), PText(success.p_adjusted), Word(success.judgment()), colors);
}

std::string MetricTable(const TaskComparison& task, const Comparison& comparison, bool colors) {
  int label_width = 30;
  for (const MetricComparison& metric : task.metrics)
    label_width = std::max(label_width, Width(Label(metric.number)));
  const Widths widths = WidthsOf(label_width, comparison);
  std::string text = TitleRow(widths, "", comparison, colors);
  text += SuccessRow("success", widths, comparison.success, colors);
  std::vector<std::string> equal;
  int tested = 0;
  for (const MetricComparison& metric : task.metrics) {
    const auto scaled = [&](double value) { return value * metric.number.scale(); };
    const int decimals = metric.decimals();
    if (!metric.p) {
      const std::string unit(metric.number.shown_unit());
      equal.push_back(metric.number.label() + " " + ShownValue(*metric.number.metric, metric.mean) +
                      (unit.empty() ? "" : " " + unit));
      continue;
    }
    text += Row(widths, Label(metric.number), FixedOrDash(scaled(metric.baseline_mean), decimals),
                FixedOrDash(scaled(metric.mean), decimals), FixedOrDash(scaled(metric.difference), decimals),
                Range({scaled(metric.difference_95.lower), scaled(metric.difference_95.upper)}, decimals),
                PText(*metric.p), PText(metric.p_holm), metric.word(), colors);
    ++tested;
  }
  if (!equal.empty()) text += fmt::format("equal everywhere: {}\n", fmt::join(equal, ", "));
  return text + fmt::format("\n{}\nHolm: p of metrics adjusted for {}. {}\n", WhatIsCounted(task),
                            Plural(tested, "metric"), kIntervalsAreSingle);
}

std::string RatioTable(const TaskComparison& task, const Comparison& comparison) {
  std::string text;
  int pairs = 0;
  for (const MetricComparison& metric : task.metrics) {
    if (!task.paired || !metric.ratio || !metric.number.metric->effort) continue;
    text += fmt::format("{}  {:>6}  {}\n", Pad(metric.number.label(), -27), FixedOrDash(*metric.ratio, 2),
                        Range(metric.ratio_95, 2));
    pairs = std::max(pairs, metric.count);
  }
  if (text.empty()) {
    return fmt::format("Effort relative to {} needs pairs in which both succeed; there are none.\n",
                       comparison.baseline.name);
  }
  return fmt::format(
      "Effort relative to {}: geometric mean of the ratios of the {} in which both succeeded, and its 95 % "
      "interval\n{}",
      comparison.baseline.name, Plural(pairs, "pair"), text);
}

std::string SuiteTable(const Comparison& comparison, bool colors) {
  int width = 7;
  for (const TaskComparison& task : comparison.tasks)
    width = std::max(width, static_cast<int>(task.task.size() + 1 + task.variation.size()));
  const Widths widths = WidthsOf(width, comparison);
  std::string text = TitleRow(widths, "success", comparison, colors);
  std::string metrics;
  for (const TaskComparison& task : comparison.tasks) {
    text += SuccessRow(task.task + "/" + task.variation, widths, task.success, colors);
    for (const MetricComparison& metric : task.metrics) {
      if (!metric.differs()) continue;
      const std::string unit(metric.number.shown_unit());
      const int decimals = metric.decimals();
      metrics +=
          fmt::format("{}  {} {} against {}{}, {}  {}\n", Pad(task.task + "/" + task.variation, -width),
                      metric.number.label(), FixedOrDash(metric.mean * metric.number.scale(), decimals),
                      FixedOrDash(metric.baseline_mean * metric.number.scale(), decimals),
                      unit.empty() ? "" : " " + unit, PEquals(metric.p_holm), metric.word());
    }
  }
  text += SuccessRow("all", widths, comparison.success, colors);
  text += "\nHolm: p adjusted for the tasks. Intervals are not adjusted: each is for its row alone.\n";
  if (!metrics.empty()) text += "\nMetrics that differ, p adjusted for those of a task\n" + metrics;
  return text;
}

}  // namespace

std::string PText(double p) {
  if (p < 0.001) return "<0.001";
  const double rounded = std::floor(1000 * p + 0.5 + 1e-9) / 1000;
  if (p < metrics::kAlpha && rounded >= metrics::kAlpha) return Fixed(std::floor(10000 * p) / 10000, 4);
  return Fixed(rounded, 3);
}

std::string PEquals(double p) { return p < 0.001 ? "p < 0.001" : "p = " + PText(p); }

std::string NameAndPolicy(const ComparedRuns& runs) {
  return runs.name == runs.policy ? runs.name : fmt::format("{} ({})", runs.name, runs.policy);
}

std::string ComparisonText(const Comparison& comparison, bool ratios, bool colors) {
  std::string text = NameAndPolicy(comparison.run) + " against " + NameAndPolicy(comparison.baseline);
  const bool one = comparison.tasks.size() == 1;
  if (one) text += ", " + comparison.tasks[0].name();
  text += "\n\n" + Styled(Headline(comparison) + ".", Style::kStrong, colors) + "\n" + Evidence(comparison) +
          "\n\n";
  text += one ? MetricTable(comparison.tasks[0], comparison, colors) : SuiteTable(comparison, colors);
  if (one && ratios) text += "\n" + RatioTable(comparison.tasks[0], comparison);
  if (!comparison.remarks.empty()) text += "\n";
  for (const std::string& remark : comparison.remarks) text += "note: " + remark + "\n";
  return text;
}

}  // namespace evalbus::results
