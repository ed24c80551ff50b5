#include "report/comparison_tables.h"

#include <gtest/gtest.h>

namespace evalbus::report::comparison_tables_test {

using results::Comparison;
using results::SuccessComparison;

SuccessComparison Success(int successes, int baseline_successes, double difference, double p) {
  SuccessComparison success;
  success.successes = successes;
  success.baseline_successes = baseline_successes;
  success.trials = success.baseline_trials = 50;
  success.samples = success;
  success.difference = difference;
  success.difference_95 = {difference - 0.1, difference + 0.125};
  success.p_adjusted = p;
  return success;
}

Comparison Example() {
  Comparison comparison;
  comparison.run.name = "new_<1>";
  comparison.baseline.name = "50 % & more";
  comparison.tasks.resize(1);
  comparison.tasks[0].task = "lift_pot";
  comparison.tasks[0].variation = comparison.tasks[0].baseline_variation = "base";
  comparison.tasks[0].success = comparison.success = Success(43, 31, 0.24, 0.0004);
  return comparison;
}

TEST(SuccessTable, HasARowPerTaskAndOneForAll) {
  Comparison comparison = Example();
  comparison.tasks.push_back(comparison.tasks[0]);
  comparison.tasks[1].task = "lift_tray";
  comparison.tasks[1].success = Success(10, 11, -0.02, 1);
  const TextTable table = SuccessTable({Example(), comparison});
  ASSERT_EQ(table.rows.size(), 4u);
  EXPECT_EQ(table.rows[2],
            (std::vector<std::string>{"lift_tray/base", "new_<1>", "10/50 (11 to 33 %)", "50 % & more",
                                      "11/50 (13 to 35 %)", "-2.0", "-12.0 to 10.5", "1.000"}));
  EXPECT_EQ(table.rows[3][0], "all");
}

// Wilson's interval of 1 of 1 begins at 1 / (1 + z^2) = 0.207.
TEST(SuccessTable, EqualEpisodesCountAsOneInTheInterval) {
  Comparison comparison = Example();
  comparison.success = Success(50, 50, 0, 1);
  comparison.success.samples.trials = 1;
  const TextTable table = SuccessTable({comparison});
  EXPECT_EQ(table.rows[0][2], "50/50 (21 to 100 %)");
  EXPECT_EQ(table.rows[0][4], "50/50 (93 to 100 %)");
}

TEST(ComparisonMarkdown, IsATableWithEscapedNames) {
  EXPECT_EQ(ComparisonMarkdown({Example()}),
            "| task | run | success of run | baseline | success of baseline | difference | 95 % CI | p |\n"
            "|---|---:|---:|---:|---:|---:|---:|---:|\n"
            "| lift\\_pot/base | new\\_&lt;1\\> | 43/50 (74 to 93 %) | 50 % & more | 31/50 (48 to 74 %) | "
            "24.0 | 14.0 to 36.5 | &lt;0.001 |\n"
            "\nSuccesses of all episodes, with Wilson's 95 % interval of each rate. Difference of the "
            "success rates in percentage points, with its 95 % interval. Test: exact McNemar; "
            "p is adjusted with Holm's method for the tasks of a run, or for the runs.\n");
}

TEST(ComparisonLatex, IsATabularWithEscapedNames) {
  const std::string text = ComparisonLatex({Example()});
  EXPECT_EQ(text.substr(text.find('\n') + 1),
            "\\begin{tabular}{lrrrrrrr}\n\\toprule\n"
            "task & run & success of run & baseline & success of baseline & difference & 95 \\% CI & p "
            "\\\\\n\\midrule\n"
            "lift\\_pot/base & new\\_$<$1$>$ & 43/50 (74 to 93 \\%) & 50 \\% \\& more & 31/50 (48 to 74 \\%) "
            "& 24.0 & 14.0 to 36.5 & "
            "$<$0.001 \\\\\n"
            "\\bottomrule\n\\end{tabular}\n");
}

}  // namespace evalbus::report::comparison_tables_test
