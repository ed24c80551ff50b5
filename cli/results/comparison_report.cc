#include "cli/results/comparison_report.h"

#include <fmt/format.h>

#include <limits>

#include "viz/report/comparison_page.h"

namespace evalbus::results {
namespace {

double Rate(int successes, int trials) {
  return trials > 0 ? static_cast<double>(successes) / trials : std::numeric_limits<double>::quiet_NaN();
}

viz::ReportDifference Success(const std::string& name, const SuccessComparison& success) {
  return {.name = name,
          .unit = "",
          .baseline = Rate(success.baseline_successes, success.baseline_trials),
          .run = Rate(success.successes, success.trials),
          .difference = success.difference,
          .lower = success.difference_95.lower,
          .upper = success.difference_95.upper,
          .p = success.p,
          .p_holm = success.p_holm,
          .judgement = Word(success.judgement())};
}

viz::ReportDifference Metric(const MetricComparison& metric) {
  const double scale = metric.number.scale();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  return {.name = metric.number.label() + (metric.number.metric->effort ? " *" : ""),
          .unit = std::string(metric.number.shown_unit()),
          .baseline = metric.baseline_mean * scale,
          .run = metric.mean * scale,
          .difference = metric.difference * scale,
          .lower = metric.difference_95.lower * scale,
          .upper = metric.difference_95.upper * scale,
          .p = metric.p.value_or(kNaN),
          .p_holm = metric.p ? metric.p_holm : kNaN,
          .judgement = Word(metric.judgement())};
}

viz::ReportTaskComparison Task(const TaskComparison& task) {
  viz::ReportTaskComparison report;
  report.task = task.task + "/" + task.variation;
  report.success = Success(report.task, task.success);
  report.counts =
      task.paired
          ? fmt::format(
                "{} pairs with the same seeds. Means over pairs; p: McNemar's exact test, and Wilcoxon's "
                "signed-rank test. * over the pairs in which both succeeded.",
                task.success.trials)
          : fmt::format(
                "Independent episodes, {} against {}. p: Fisher's exact test, and Mann-Whitney's test. * "
                "over "
                "successes only.",
                task.success.trials, task.success.baseline_trials);
  for (const MetricComparison& metric : task.metrics) report.metrics.push_back(Metric(metric));
  return report;
}

}  // namespace

std::string ComparisonReport(const std::vector<Comparison>& comparisons, const std::string& made_by) {
  std::vector<viz::ReportComparison> reports;
  for (const Comparison& comparison : comparisons) {
    viz::ReportComparison report;
    report.run = fmt::format("{} ({})", comparison.run.name, comparison.run.policy);
    report.baseline = fmt::format("{} ({})", comparison.baseline.name, comparison.baseline.policy);
    report.verdict = Conclusion(comparison);
    for (const TaskComparison& task : comparison.tasks) report.tasks.push_back(Task(task));
    report.success = Success("all", comparison.success);
    report.notes = comparison.remarks;
    report.notes.push_back(
        "Intervals: Newcombe's for success, bootstrap for means. Holm: p adjusted for the number of tests of "
        "a "
        "table. Each metric's interval is drawn on its own scale.");
    reports.push_back(std::move(report));
  }
  return viz::ComparisonPage("Comparison with " + reports.front().baseline, reports, made_by);
}

}  // namespace evalbus::results
