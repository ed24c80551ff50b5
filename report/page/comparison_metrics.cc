#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <limits>

#include "base/text.h"
#include "metrics/statistics/interval.h"
#include "report/page/comparison_page.h"
#include "report/page/figures.h"
#include "report/page/page.h"
#include "report/page/ratio_axis.h"
#include "results/comparison_text.h"
#include "results/conclusion.h"

namespace evalbus::report {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::string JudgmentClass(results::Judgment judgment) {
  const std::string word = results::Word(judgment);
  return word.empty() ? "none" : word;
}

std::string PValue(double p) { return p < 0.001 ? "< 0.001" : results::PText(p); }

std::string IntervalText(const results::SuccessComparison& success) {
  const auto [lower, upper] = results::BoundsInPoints(success);
  return WithMinus(lower) + " to " + WithMinus(upper);
}

// Title and CSS class of the table's columns. Columns of the class "minor" are hidden on phones.
using Columns = std::vector<std::pair<std::string, std::string>>;

void ColumnTitles(const Columns& columns, Markup* html) {
  for (const auto& [title, css_class] : columns) html->Element("th", {{"class", css_class}}, title);
}

// Writes a side's success rate as a bar with its interval.
void SideRow(const std::string& name, const char* css_class, int successes, int trials, int samples,
             Markup* html) {
  const double rate = trials > 0 ? static_cast<double>(successes) / trials : kUnknown;
  html->Element("tr", {}, [&] {
    html->Element("th", {{"scope", "row"}}, name);
    html->Element("td", {{"class", "bar"}}, [&] {
      if (!std::isfinite(rate)) return;
      const metrics::Interval interval = metrics::WilsonInterval(rate * samples, samples);
      DrawShare(rate, interval.lower, interval.upper, false, html, css_class);
    });
    NumberCell(rate, Percent(rate), html);
    html->Element("td", {{"class", "number note"}}, fmt::format("{} of {}", successes, trials));
  });
}

void DifferenceRow(const results::SuccessComparison& success, Markup* html) {
  const metrics::Interval& interval = success.difference_95;
  html->Element("tr", {}, [&] {
    html->Element("th", {{"scope", "row"}}, "difference");
    html->Element("td", {{"class", "bar"}}, [&] {
      DrawDifference(success.difference, interval.lower, interval.upper, true,
                     JudgmentClass(success.judgment()), html);
    });
    html->Element("td", {{"class", "number"}}, WithMinus(results::DifferenceInPoints(success)) + " points");
    html->Element("td", {{"class", "number note"}}, IntervalText(success));
  });
}

void TaskRow(const std::string& name, const results::SuccessComparison& success, Markup* html) {
  const auto rate = [&](int successes, int trials) {
    const double share = trials > 0 ? static_cast<double>(successes) / trials : kUnknown;
    NumberCell(share, Percent(share), html);
  };
  const metrics::Interval& interval = success.difference_95;
  html->Element("tr", {{"data-metric", name}}, [&] {
    html->Element("th", {{"scope", "row"}}, name);
    rate(success.baseline_successes, success.baseline_trials);
    rate(success.successes, success.trials);
    if (!success.has_both_sides()) {
      NumberCell(kUnknown, "-", html);
      html->Element("td", {{"class", "bar"}}, "");
      html->Element("td", {{"class", "number minor"}}, "-");
      NumberCell(kUnknown, "-", html);
      html->Element("td", {}, "");
      return;
    }
    NumberCell(success.difference, WithMinus(results::DifferenceInPoints(success)), html);
    html->Element("td", {{"class", "bar"}}, [&] {
      DrawDifference(success.difference, interval.lower, interval.upper, false,
                     JudgmentClass(success.judgment()), html);
    });
    html->Element("td", {{"class", "number minor"}}, IntervalText(success));
    NumberCell(success.p_adjusted, PValue(success.p_adjusted), html);
    html->Element("td", {{"class", JudgmentClass(success.judgment())}}, results::Word(success.judgment()));
  });
}

// A ratio of 0 cannot be drawn on the logarithmic axis.
bool HasDrawnRatio(const results::MetricComparison& metric) { return metric.ratio && *metric.ratio > 0; }

void MetricRow(const results::MetricComparison& metric, const RatioAxis& axis, Markup* html) {
  const double scale = metric.number.scale();
  const std::string unit(metric.number.shown_unit());
  const std::string css_class = JudgmentClass(metric.judgment());
  const auto number = [&](double value) { return WithMinus(Fixed(value * scale, metric.decimals())); };
  html->Element("tr", {{"data-metric", metric.number.name}}, [&] {
    html->Element("th", {{"scope", "row"}}, [&] {
      html->Text(metric.number.label() + (metric.number.metric->effort ? " *" : ""));
      if (!unit.empty()) html->Element("span", {{"class", "unit"}}, ", " + unit);
    });
    for (const double mean : {metric.baseline_mean, metric.mean}) {
      html->Element("td", {{"class", "number minor"}}, [&] { Data(mean, number(mean), html); });
    }
    html->Element("td", {{"class", "bar"}}, [&] {
      if (HasDrawnRatio(metric)) axis.Draw(*metric.ratio, metric.ratio_95, css_class, html);
    });
    html->Element("td", {{"class", "number"}}, [&] {
      if (HasDrawnRatio(metric)) return Data(*metric.ratio, RatioText(*metric.ratio, metric.ratio_95), html);
      html->Text(metric.baseline_mean == 0 ? "from 0" : "-");
    });
    html->Element("td", {{"class", "number minor"}}, [&] {
      Data(metric.difference, number(metric.difference), html);
      const metrics::Interval& interval = metric.difference_95;
      if (std::isfinite(interval.lower))
        html->Text(fmt::format(" ({} to {})", number(interval.lower), number(interval.upper)));
    });
    html->Element("td", {{"class", "number minor"}},
                  [&] { Data(metric.p_holm, PValue(metric.p_holm), html); });
    html->Element("td", {{"class", css_class}}, metric.word());
  });
}

// Writes a paragraph that lists the metrics without a difference.
void EqualMetrics(const results::TaskComparison& task,
                  const std::vector<const results::MetricComparison*>& equal, Markup* html) {
  if (equal.empty()) return;
  std::vector<std::string> parts;
  for (const results::MetricComparison* metric : equal) {
    parts.push_back(metric->number.label() + " " + ShownWithUnit(*metric->number.metric, metric->mean));
  }
  html->Element("p", {{"class", "note"}},
                fmt::format("Metrics {}: {}.", results::EqualTitle(task), fmt::join(parts, "; ")));
}

}  // namespace

void WriteSuccess(const results::Comparison& comparison, Markup* html) {
  const results::SuccessComparison& success = comparison.success;
  html->Element("table", {{"class", "bars sides"}}, [&] {
    html->Element("tbody", {}, [&] {
      SideRow(comparison.baseline.name, "side-a", success.baseline_successes, success.baseline_trials,
              success.samples.baseline_trials, html);
      SideRow(comparison.run.name, "side-b", success.successes, success.trials, success.samples.trials, html);
      if (success.has_both_sides()) DifferenceRow(success, html);
    });
  });
  if (comparison.tasks.size() < 2) return;
  const auto titles = [&] {
    ColumnTitles({{"success", ""},
                  {comparison.baseline.name, "number"},
                  {comparison.run.name, "number"},
                  {"difference, points", "number"},
                  {"95 % CI of the difference", "unsorted"},
                  {"points", "unsorted minor number"},
                  {"p, adjusted", "number"},
                  {"verdict", ""}},
                 html);
  };
  const auto rows = [&] {
    for (const results::TaskComparison& task : comparison.tasks) TaskRow(task.name(), task.success, html);
    TaskRow("all", success, html);
  };
  ScrollingTable({{"class", "sortable comparison"}, {"id", ""}}, titles, rows, html);
}

void WriteMetrics(const results::Comparison& comparison, const results::TaskComparison& task,
                  const char* heading, Markup* html) {
  RatioAxis axis;
  std::vector<const results::MetricComparison*> tested, equal;
  for (const results::MetricComparison& metric : task.metrics) {
    (metric.p ? tested : equal).push_back(&metric);
    if (metric.p && HasDrawnRatio(metric)) axis.Include(*metric.ratio, metric.ratio_95);
  }
  if (tested.empty() && equal.empty()) return;
  html->Element(heading, {}, "Metrics");
  html->Element("p", {{"class", "note"}}, results::WhatIsCounted(task));
  const auto titles = [&] {
    ColumnTitles(
        {{"metric", ""}, {comparison.baseline.name, "number minor"}, {comparison.run.name, "number minor"}},
        html);
    html->Element("th", {{"class", "unsorted"}}, [&] {
      html->Text("relative to " + comparison.baseline.name);
      axis.DrawLabels(html);
    });
    ColumnTitles({{"ratio", "number"},
                  {"difference (95 % CI)", "number minor"},
                  {"p, adjusted", "number minor"},
                  {"verdict", ""}},
                 html);
  };
  const auto rows = [&] {
    for (const results::MetricComparison* metric : tested) MetricRow(*metric, axis, html);
  };
  if (!tested.empty()) ScrollingTable({{"class", "sortable comparison"}, {"id", ""}}, titles, rows, html);
  EqualMetrics(task, equal, html);
}

}  // namespace evalbus::report
