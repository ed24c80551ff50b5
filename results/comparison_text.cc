#include "results/comparison_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/help.h"
#include "base/styled_text.h"
#include "base/text.h"
#include "results/conclusion.h"
#include "results/summary_table.h"

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

// A column between the values of the two sides and the verdict.
struct DifferenceColumn {
  const char* title;
  int width;
};
constexpr std::array kDifferenceColumns = {DifferenceColumn{"difference", 9},
                                           DifferenceColumn{"95 % CI of difference", 21},
                                           DifferenceColumn{"p", 6}, DifferenceColumn{"Holm", 6}};
// Indices of these columns in the order in which they are omitted if the terminal is too narrow. The verdict
// follows from Holm's method.
constexpr std::array<size_t, kDifferenceColumns.size()> kOmittedFirst = {2, 1, 3, 0};

struct ComparedRow {
  std::string label, baseline, run;
  std::array<std::string, kDifferenceColumns.size()> differences;
  std::string verdict;
};

// Widths in characters, and the columns that are shown.
struct ComparedLayout {
  int label, side;
  std::array<bool, kDifferenceColumns.size()> is_shown{true, true, true, true};
  // False if "lower (made less progress)" is shortened to "lower". A note repeats the reason.
  bool has_reasons = true;

  std::string Verdict(const ComparedRow& row) const {
    return has_reasons ? row.verdict : row.verdict.substr(0, row.verdict.find(" ("));
  }
};

std::string RowText(const ComparedLayout& layout, const ComparedRow& row, bool colors) {
  std::string line = Pad(row.label, -layout.label) + "  " + Pad(row.baseline, layout.side) + "  " +
                     Pad(row.run, layout.side);
  for (size_t i = 0; i < kDifferenceColumns.size(); ++i) {
    if (layout.is_shown[i]) line += "  " + Pad(row.differences[i], kDifferenceColumns[i].width);
  }
  const std::string verdict = layout.Verdict(row);
  if (verdict.empty()) return line + "\n";
  const Style style = verdict == Word(Judgment::kBetter)  ? Style::kGood
                      : verdict == Word(Judgment::kWorse) ? Style::kBad
                                                          : Style::kQuiet;
  return line + "  " + Styled(verdict, style, colors) + "\n";
}

// Wraps text that begins at column `indent`, unless it fits into one line.
std::string WrappedToFit(const std::string& text, int indent, int width) {
  if (Width(text) <= width - indent) return text;
  return Wrapped(text, static_cast<size_t>(indent), static_cast<size_t>(width));
}

// Returns the label, with "*" for a metric of effort.
std::string MarkedLabel(const MetricNumber& number) {
  return number.label() + (number.metric->effort ? " *" : "");
}

std::string Label(const MetricNumber& number) {
  const std::string unit(number.shown_unit());
  return MarkedLabel(number) + (unit.empty() ? "" : ", " + unit);
}

// Returns the layout of a table in a terminal of this width. If it is too narrow, shortens names and omits
// columns.
ComparedLayout LayoutOf(const std::vector<ComparedRow>& rows, int label, const Comparison& comparison,
                        int width) {
  constexpr int kLeast = 9, kMost = 16;
  ComparedLayout layout{
      .label = label,
      .side =
          std::clamp(std::max(Width(comparison.baseline.name), Width(comparison.run.name)), kLeast, kMost)};
  // Width of a row without the values of the two sides.
  const auto width_of_rest = [&] {
    int used = layout.label + 2 * 2, verdict = -2;
    for (size_t i = 0; i < kDifferenceColumns.size(); ++i) {
      const DifferenceColumn& column = kDifferenceColumns[i];
      if (layout.is_shown[i]) used += 2 + std::max(column.width, Width(column.title));
    }
    for (const ComparedRow& row : rows) {
      if (!row.verdict.empty()) verdict = std::max(verdict, Width(layout.Verdict(row)));
    }
    return used + 2 + verdict;
  };
  if (2 * layout.side <= width - width_of_rest()) return layout;
  layout.has_reasons = false;
  for (const size_t column : kOmittedFirst) {
    if (2 * kLeast <= width - width_of_rest()) break;
    layout.is_shown[column] = false;
  }
  layout.side = std::clamp((width - width_of_rest()) / 2, kLeast, layout.side);
  return layout;
}

// Shortens a name that is too long to its end, where names of checkpoints often differ.
std::string Short(const std::string& name, int width) {
  const int cut = Width(name) - width;
  return cut <= 0 ? name : ".." + name.substr(Cut(name, cut + 2).size());
}

// Returns a table and, below it, the names of omitted columns. title: title of the labels, which are `label`
// characters wide.
std::string ComparedTable(const std::string& title, int label, const std::vector<ComparedRow>& rows,
                          const Comparison& comparison, int width, bool colors) {
  const ComparedLayout layout = LayoutOf(rows, label, comparison, width);
  ComparedRow titles{
      title, Short(comparison.baseline.name, layout.side), Short(comparison.run.name, layout.side), {}, ""};
  std::vector<std::string> omitted;
  for (size_t i = 0; i < kDifferenceColumns.size(); ++i) {
    titles.differences[i] = kDifferenceColumns[i].title;
    if (!layout.is_shown[i]) omitted.push_back(titles.differences[i]);
  }
  std::string text = RowText(layout, titles, colors);
  for (const ComparedRow& row : rows) text += RowText(layout, row, colors);
  if (omitted.empty()) return text;
  return text +
         OmittedColumnsText({fmt::format("{} (see --json or --report)", fmt::join(omitted, ", "))}, width);
}

ComparedRow SuccessRow(const std::string& label, const SuccessComparison& success) {
  const auto rate = [](int k, int n) { return Percent(static_cast<double>(k) / n); };
  if (!success.has_both_sides()) {
    return {label,
            rate(success.baseline_successes, success.baseline_trials),
            rate(success.successes, success.trials),
            {"-", "-", "-", "-"},
            ""};
  }
  const auto [lower, upper] = BoundsInPoints(success);
  return {label,
          rate(success.baseline_successes, success.baseline_trials),
          rate(success.successes, success.trials),
          {DifferenceInPoints(success), fmt::format("{:>8} to {:>8}", lower, upper), PText(success.p),
           PText(success.p_adjusted)},
          Word(success.judgment())};
}

std::string MetricTable(const TaskComparison& task, const Comparison& comparison, int width, bool colors) {
  int label_width = 30;
  for (const MetricComparison& metric : task.metrics)
    label_width = std::max(label_width, Width(Label(metric.number)));
  std::vector<ComparedRow> rows = {SuccessRow("success", comparison.success)};
  std::vector<std::string> equal;
  for (const MetricComparison& metric : task.metrics) {
    const auto scaled = [&](double value) { return value * metric.number.scale(); };
    const int decimals = metric.decimals();
    if (!metric.p) {
      equal.push_back(metric.number.label() + " " + ShownWithUnit(*metric.number.metric, metric.mean));
      continue;
    }
    rows.push_back(
        {Label(metric.number),
         FixedOrDash(scaled(metric.baseline_mean), decimals),
         FixedOrDash(scaled(metric.mean), decimals),
         {FixedOrDash(scaled(metric.difference), decimals),
          Range({scaled(metric.difference_95.lower), scaled(metric.difference_95.upper)}, decimals),
          PText(*metric.p), PText(metric.p_holm)},
         metric.word()});
  }
  std::string text = ComparedTable("", label_width, rows, comparison, width, colors);
  if (!equal.empty())
    text += WrappedToFit(fmt::format("{}: {}", EqualTitle(task), fmt::join(equal, "; ")), 2, width) + "\n";
  if (!task.paired && (task.complete == 0 || task.baseline_complete == 0)) return text;
  std::string adjusted = kIntervalsAreSingle;
  if (rows.size() > 1) {
    adjusted = fmt::format("Holm: p of metrics adjusted for {}. {}",
                           Plural(static_cast<int64_t>(rows.size()) - 1, "metric"), adjusted);
  }
  return text + "\n" + WrappedToFit(WhatIsCounted(task), 0, width) + "\n" + WrappedToFit(adjusted, 0, width) +
         "\n";
}

// Returns an empty string if there are pairs in which both succeeded, but no ratio, for example because no
// metric of effort was chosen.
std::string RatioTable(const TaskComparison& task, const Comparison& comparison, int width) {
  std::string text;
  int pairs = 0;
  for (const MetricComparison& metric : task.metrics) {
    if (!task.paired || !metric.ratio || !metric.number.metric->effort) continue;
    text += fmt::format("{}  {:>6}  {}\n", Pad(metric.number.label(), -27), FixedOrDash(*metric.ratio, 2),
                        Range(metric.ratio_95, 2));
    pairs = std::max(pairs, metric.count);
  }
  if (text.empty() && task.success.pairs.both > 0) return "";
  const std::string what =
      text.empty() ? fmt::format("Effort relative to {} needs pairs in which both succeed; there are none.",
                                 comparison.baseline.name)
                   : fmt::format(
                         "Effort relative to {}: geometric mean of the ratios of the {} in which both "
                         "succeeded, and its 95 % interval",
                         comparison.baseline.name, Plural(pairs, "pair"));
  return "\n" + WrappedToFit(what, 0, width) + "\n" + text;
}

std::string SuiteTable(const Comparison& comparison, int width, bool colors) {
  int label_width = 7;
  for (const TaskComparison& task : comparison.tasks)
    label_width = std::max(label_width, static_cast<int>(task.task.size() + 1 + task.variation.size()));
  std::vector<ComparedRow> rows;
  std::string metrics;
  for (const TaskComparison& task : comparison.tasks) {
    const std::string name = task.task + "/" + task.variation;
    rows.push_back(SuccessRow(name, task.success));
    for (const MetricComparison& metric : task.metrics) {
      if (!metric.differs()) continue;
      const std::string unit(metric.number.shown_unit());
      const auto shown = [&](double value) {
        return FixedOrDash(value * metric.number.scale(), metric.decimals());
      };
      const std::string what =
          fmt::format("{} {} against {}, {}  {}", MarkedLabel(metric.number), shown(metric.mean),
                      WithUnit(shown(metric.baseline_mean), unit), PEquals(metric.p_holm), metric.word());
      metrics += Pad(name, -label_width) + "  " + WrappedToFit(what, label_width + 2, width) + "\n";
    }
  }
  rows.push_back(SuccessRow("all", comparison.success));
  std::string text = ComparedTable("success", label_width, rows, comparison, width, colors) + "\n";
  text += WrappedToFit(
              "Holm: p adjusted for the tasks; in the row 'all', for the runs that are compared. "
              "Intervals are not adjusted: each is for its row alone.",
              0, width) +
          "\n";
  if (!metrics.empty())
    text +=
        "\nMetrics that differ (p adjusted for the number of metrics of each task; *: over successes or, in "
        "pairs, over pairs of successes)\n" +
        metrics;
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

std::string ComparisonText(const Comparison& comparison, bool ratios, bool colors, int width) {
  std::string title = NameAndPolicy(comparison.run) + " against " + NameAndPolicy(comparison.baseline);
  const bool one = comparison.tasks.size() == 1;
  if (one) title += ", " + comparison.tasks[0].name();
  std::string text =
      WrappedToFit(title, 0, width) + "\n\n" + ConclusionText(comparison, width, colors) + "\n";
  text += one ? MetricTable(comparison.tasks[0], comparison, width, colors)
              : SuiteTable(comparison, width, colors);
  if (one && ratios && comparison.success.has_both_sides())
    text += RatioTable(comparison.tasks[0], comparison, width);
  if (!comparison.remarks.empty()) text += "\n";
  for (const std::string& remark : comparison.remarks)
    text += WrappedToFit("note: " + remark, 2, width) + "\n";
  return text;
}

std::string ConclusionText(const Comparison& comparison, int width, bool colors) {
  const std::string evidence = Evidence(comparison);
  return WrappedToFit(Styled(Headline(comparison) + ".", Style::kStrong, colors), 0, width) + "\n" +
         (evidence.empty() ? "" : WrappedToFit(evidence, 0, width) + "\n");
}

}  // namespace evalbus::results
