#include "report/comparison_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>
#include <set>
#include <string>
#include <string_view>

#include "base/text.h"
#include "metrics/statistics/interval.h"
#include "results/comparison_text.h"
#include "results/conclusion.h"

namespace evalbus::report {
namespace {

using results::Comparison;
using results::SuccessComparison;
using results::TaskComparison;

std::string LatexCell(const std::string& text) {
  std::string escaped;
  const std::string printable = Printable(text);
  for (size_t i = 0; i < printable.size(); ++i) {
    const char c = printable[i];
    // True for a minus sign, false for a hyphen.
    const bool is_sign = c == '-' && (i == 0 || printable[i - 1] == ' ') && i + 1 < printable.size() &&
                         std::isdigit(static_cast<unsigned char>(printable[i + 1]));
    switch (c) {
      case '-':
        escaped += is_sign ? "$-$" : "-";
        break;
      case '\\':
        escaped += "\\textbackslash{}";
        break;
      case '~':
        escaped += "\\textasciitilde{}";
        break;
      case '^':
        escaped += "\\textasciicircum{}";
        break;
      // In text mode, LaTeX's default fonts show other characters for these.
      case '<':
      case '>':
        escaped += fmt::format("${}$", c);
        break;
      default:
        if (std::string_view("&%$#_{}").find(c) != std::string_view::npos) escaped += '\\';
        escaped += c;
    }
  }
  return escaped;
}

std::vector<std::string> SuccessCells(const Comparison& comparison, const std::string& task,
                                      const SuccessComparison& success) {
  const auto points = [](double share) { return PercentagePoints(share, 1); };
  const bool has_both = success.has_both_sides();
  return {task,
          comparison.run.name,
          RateCell(success.successes, success.trials, success.samples.trials),
          comparison.baseline.name,
          RateCell(success.baseline_successes, success.baseline_trials, success.samples.baseline_trials),
          has_both ? points(success.difference) : "-",
          has_both ? fmt::format("{} to {}", points(success.difference_95.lower),
                                 points(success.difference_95.upper))
                   : "-",
          has_both ? results::PText(success.p_adjusted) : "-"};
}

std::string HowTested(const std::vector<Comparison>& comparisons) {
  std::set<std::string> tests;
  for (const Comparison& comparison : comparisons) {
    tests.insert(results::TestName(comparison.success.test));
    for (const TaskComparison& task : comparison.tasks) tests.insert(results::TestName(task.success.test));
  }
  return fmt::format(
      "Successes of all episodes, with Wilson's 95 % interval of each rate. Difference of the success rates "
      "in percentage points, with its 95 % interval. Test: {}; p is adjusted "
      "with Holm's method for the tasks of a run, or for the runs.",
      fmt::join(tests, " or "));
}

}  // namespace

std::string MarkdownCell(const std::string& text) {
  std::string escaped;
  for (const char c : Printable(text)) {
    if (c == '<') {
      escaped += "&lt;";
      continue;
    }
    if (std::string_view("\\`*_[]|#>").find(c) != std::string_view::npos) escaped += '\\';
    escaped += c;
  }
  return escaped;
}

std::string MarkdownTable(const TextTable& table) {
  const auto row = [](const std::vector<std::string>& cells) {
    std::string line = "|";
    for (const std::string& cell : cells) line += " " + MarkdownCell(cell) + " |";
    return line + "\n";
  };
  std::string text = row(table.header) + "|---|";
  for (size_t i = 1; i < table.header.size(); ++i) text += "---:|";
  text += "\n";
  for (const auto& cells : table.rows) text += row(cells);
  return text;
}

std::string LatexTable(const TextTable& table) {
  const auto row = [](const std::vector<std::string>& cells) {
    std::vector<std::string> escaped;
    for (const std::string& cell : cells) escaped.push_back(LatexCell(cell));
    return fmt::format("{} \\\\\n", fmt::join(escaped, " & "));
  };
  std::string text = fmt::format("\\begin{{tabular}}{{l{}}}\n\\toprule\n{}\\midrule\n",
                                 std::string(table.header.size() - 1, 'r'), row(table.header));
  for (const auto& cells : table.rows) text += row(cells);
  return text + "\\bottomrule\n\\end{tabular}\n";
}

std::string RateCell(int successes, int trials, double samples) {
  if (trials == 0) return "-";
  const metrics::Interval wilson = metrics::WilsonInterval(samples * successes / trials, samples);
  return fmt::format("{}/{} ({} to {} %)", successes, trials, PercentagePoints(wilson.lower),
                     PercentagePoints(wilson.upper));
}

TextTable SuccessTable(const std::vector<Comparison>& comparisons) {
  TextTable table = {.header = {"task", "run", "success of run", "baseline", "success of baseline",
                                "difference", "95 % CI", "p"},
                     .rows = {}};
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
