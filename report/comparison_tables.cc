#include "report/comparison_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <string>

#include "base/text.h"
#include "results/comparison_text.h"
#include "results/conclusion.h"

namespace evalbus::report {
namespace {

using results::Comparison;
using results::SuccessComparison;
using results::TaskComparison;

std::vector<std::string> SuccessCells(const Comparison& comparison, const std::string& task,
                                      const SuccessComparison& success) {
  const auto points = [](double share) { return PercentagePoints(share, 1); };
  return {task,
          comparison.run.name,
          fmt::format("{}/{}", success.successes, success.trials),
          comparison.baseline.name,
          fmt::format("{}/{}", success.baseline_successes, success.baseline_trials),
          points(success.difference),
          fmt::format("{} to {}", points(success.difference_95.lower), points(success.difference_95.upper)),
          results::PText(success.p_adjusted)};
}

std::string HowTested(const std::vector<Comparison>& comparisons) {
  std::set<std::string> tests;
  for (const Comparison& comparison : comparisons) {
    tests.insert(results::TestName(comparison.success.test));
    for (const TaskComparison& task : comparison.tasks) tests.insert(results::TestName(task.success.test));
  }
  return fmt::format(
      "Difference of the success rates in percentage points, with its 95 % interval. Test: {}; p is adjusted "
      "with Holm's method for the tasks of a run, or for the runs.",
      fmt::join(tests, " or "));
}

}  // namespace

TextTable SuccessTable(const std::vector<Comparison>& comparisons) {
  TextTable table = {
      .header = {"task", "run", "success", "baseline", "success", "difference", "95 % CI", "p"}, .rows = {}};
  for (const Comparison& comparison : comparisons) {
    if (comparison.tasks.size() > 1) {
      for (const TaskComparison& task : comparison.tasks)
        table.rows.push_back(SuccessCells(comparison, task.name(), task.success));
    }
    // In the row over all tasks, p is adjusted for the number of runs.
    const bool is_single = comparison.tasks.size() == 1;
    table.rows.push_back(
        SuccessCells(comparison, is_single ? comparison.tasks[0].name() : "all", comparison.success));
  }
  return table;
}

std::string ComparisonMarkdown(const std::vector<Comparison>& comparisons) {
  return MarkdownTable(SuccessTable(comparisons)) + "\n" + HowTested(comparisons) + "\n";
}

std::string ComparisonLatex(const std::vector<Comparison>& comparisons) {
  return "% " + HowTested(comparisons) + "\n" + LatexTable(SuccessTable(comparisons));
}

}  // namespace evalbus::report
