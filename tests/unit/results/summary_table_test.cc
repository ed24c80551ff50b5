#include "results/summary_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/text.h"
#include "tests/unit/longest_line.h"

namespace evalbus::results::summary_table_test {

bool Has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

metrics::RunSummary Summary(int complete, int success) {
  metrics::RunSummary s;
  s.episodes = s.complete = s.judged = s.samples = complete;
  s.successes = success;
  s.success_rate = complete > 0 ? static_cast<double>(success) / complete : 0;
  s.wilson = {0.0945, 0.9055};
  s.failure_reasons = {{"timeout", 3}, {"dropped", 1}};
  const double nan = std::nan("");
  s.metrics = {
      {"slip_count", 2, 1.5, 0.5, 1, 1, 2, 1, 2, {1, 2}},
      {"extended.min_clearance_m", 2, 0.16345, nan, 0.2, 0.1, 0.3, 0.1, 0.3, {nan, nan}},
      {"bimanual_gripper_vertical_difference",
       2,
       0.0001234,
       12.3456,
       1234.5678,
       0,
       1,
       0,
       1,
       {0.0001, 0.0125}},
  };
  return s;
}

TEST(PercentText, HasADecimalWhereItIsNarrow) {
  EXPECT_EQ(PercentText({0.7225, 1}), "72 to 100 %");
  // This is the interval of 3,297 successes in 3,300 episodes.
  EXPECT_EQ(PercentText({0.99733, 0.99969}), "99.7 to 100.0 %");
}

TEST(FormatDuration, HasTheUnitThatFits) {
  EXPECT_EQ(FormatDuration(-3), "0 s");
  EXPECT_EQ(FormatDuration(0.4), "0 s");
  EXPECT_EQ(FormatDuration(59.4), "59 s");
  EXPECT_EQ(FormatDuration(59.5), "1:00 min");
  EXPECT_EQ(FormatDuration(65), "1:05 min");
  EXPECT_EQ(FormatDuration(3599), "59:59 min");
  EXPECT_EQ(FormatDuration(3600), "1:00:00 h");
  EXPECT_EQ(FormatDuration(90061), "25:01:01 h");
}

TEST(SummaryTable, ShowsRateIntervalAndMetricsWithUnits) {
  EXPECT_EQ(SummaryTable(Summary(5, 1), 80),
            "Success in 1 of 5 episodes: 20 % (95 % interval 9 to 91 %, Wilson)\n"
            "Failures: 3 time limit, 1 dropped\n"
            "\n"
            "                              mean     95 % CI of mean      std   median\n"
            "slips                         1.50        1 to       2     0.50        1\n"
            "smallest clearance           163.5                   -        -    200.0  mm\n"
            "gripper height difference        0        0 to      12    12346    1235k  mm\n"
            "not shown at 80 columns: p5, p95, max (see summary.json); path (see\n"
            "  episodes.jsonl)\n");
}

TEST(SummaryTable, EpisodesThatWereNotJudgedAreNoFailures) {
  metrics::RunSummary summary = Summary(5, 1);
  summary.judged = 3;
  summary.failure_reasons = {{"not_judged", 2}, {"timeout", 1}, {"dropped", 1}};
  const std::string table = SummaryTable(summary, 80);
  EXPECT_TRUE(Has(table, "\nFailures: 1 time limit, 1 dropped\nNot judged: 2\n")) << table;
  summary.judged = summary.successes = 0;
  summary.failure_reasons = {{"not_judged", 5}};
  EXPECT_TRUE(SummaryTable(summary, 80)
                  .starts_with("Success was not judged: poses of objects are missing\nNot judged: 5\n"))
      << SummaryTable(summary, 80);
}

// Digits beyond the precision are not shown. With a standard deviation of 0.5 s, the mean of 16 episodes has
// a standard error of 0.12 s.
TEST(SummaryTable, ShowsTwoDigitsOfTheErrorAtMost) {
  metrics::RunSummary summary = Summary(16, 16);
  summary.failure_reasons.clear();
  summary.metrics = {{"completion_time", 16, 5.0496, 0.4853, 5.24, 4.0, 6.0, 4.0, 6.0, {4.791, 5.308}}};
  EXPECT_TRUE(Has(SummaryTable(summary, 80),
                  "completion time               5.05     4.79 to    5.31     0.49     5.24  s\n"))
      << SummaryTable(summary, 80);
}

TEST(RepeatabilityText, IsTheLargestOfTheStarts) {
  metrics::RunSummary summary = Summary(40, 30);
  EXPECT_EQ(RepeatabilityText(summary), "");
  summary.repeatability = {{{}, 10, {{"left_wrist", {0.00123, 0.01}}, {"pot", {0.0456, 0.02}}}}};
  EXPECT_EQ(RepeatabilityText(summary),
            "Repeatability of the final pose (mean + 3 s as in ISO 9283; 10 successes from equal starts): "
            "left wrist 1.23 mm and 0.57 degrees, pot 46 mm and 1.15 degrees");
  summary.repeatability.push_back(
      {{{"pot_x_m", 0.1}}, 20, {{"left_wrist", {0.001, 0.04}}, {"pot", {0.1, 0.01}}}});
  EXPECT_EQ(
      RepeatabilityText(summary),
      "Repeatability of the final pose (mean + 3 s as in ISO 9283; the largest of 2 starts with at least "
      "10 successes each): left wrist 1.23 mm and 2.29 degrees, pot 100 mm and 1.15 degrees");
  EXPECT_TRUE(Has(SummaryTable(summary, 80), "\nRepeatability of the final pose"))
      << SummaryTable(summary, 80);
}

TEST(SummaryTable, StatesThatCompletionTimeIsOfSuccesses) {
  metrics::RunSummary summary = Summary(5, 2);
  summary.metrics.insert(summary.metrics.begin(), {"completion_time", 2, 5, 1, 5, 4, 6, 4, 6, {-4, 14}});
  const std::string table = SummaryTable(summary, 80);
  EXPECT_TRUE(Has(table, "\ncompletion time *             5.00")) << table;
  EXPECT_TRUE(Has(table, "\n* over the 2 episodes that succeeded; everything else over all 5\n")) << table;
}

TEST(SummaryTable, StatesThatStagesAreNotConditionsOfSuccess) {
  metrics::RunSummary summary = Summary(5, 2);
  summary.successes_without_stage = 1;
  EXPECT_TRUE(Has(SummaryTable(summary, 80), "\nNote: " + summary.StagesText() + "\n"));
}

// The table also lists a plugin's metric.
TEST(SummaryTable, ShowsTargetDistances) {
  metrics::RunSummary summary = Summary(2, 1);
  summary.metrics.push_back(
      {"target_distance.peg_depth", 2, 0.0123, 0.001, 0.0123, 0.01, 0.02, 0.01, 0.02, {0.01, 0.02}});
  const std::string table = SummaryTable(summary, 80);
  EXPECT_TRUE(Has(table, "\npeg depth  ")) << table;
}

// A metric that only one episode has, or that differs between episodes, stays in the table.
TEST(SummaryTable, FoldsMetricsThatAreEqualInEveryEpisode) {
  metrics::RunSummary summary = Summary(2, 1);
  const double nan = std::nan("");
  summary.metrics.push_back({"env_collision_count", 2, 0, 0, 0, 0, 0, 0, 0, {nan, nan}});
  summary.metrics.push_back({"self_collision_count", 2, 3, 0, 3, 3, 3, 3, 3, {nan, nan}});
  const std::string table = SummaryTable(summary, 80);
  EXPECT_TRUE(
      Has(table, "mm\nequal in every episode: collisions with the scene 0; self collisions 3\nnot shown "))
      << table;
  summary.metrics.back().episodes = 1;
  EXPECT_TRUE(Has(SummaryTable(summary, 80), "\nself collisions  ")) << SummaryTable(summary, 80);
}

// 202 is the color of failures (base/styled_text.cc).
TEST(SummaryTable, HasColorsOnRequestOnly) {
  EXPECT_FALSE(Has(SummaryTable(Summary(5, 1), 80), "\x1b"));
  const std::string table = SummaryTable(Summary(5, 1), 80, true);
  EXPECT_TRUE(table.starts_with("\x1b[1mSuccess in 1 of 5 episodes: 20 %\x1b[0m (95 %")) << table;
  EXPECT_TRUE(Has(table, "\n\x1b[38;5;202mFailures: 3 time limit, 1 dropped\x1b[0m\n")) << table;
}

TEST(FailedEpisodesText, HasACommandForEach) {
  EXPECT_EQ(FailedEpisodesText({}, "runs/a", 80, false), "");
  std::vector<FailedEpisode> failed = {
      {3, "grasp_slip", {"lost_object", 3.62, "Right gripper lost the pot."}}, {12, "timeout", {}}};
  EXPECT_EQ(FailedEpisodesText(failed, "runs/a b", 30, false),
            "failures\n"
            "      3  slipped from the gripper  evalbus web 'runs/a b' --episode 3\n"
            "         Right gripper lost\n"
            "         the pot.\n"
            "     12  time limit                evalbus web 'runs/a b' --episode 12\n");
  failed.resize(11, {20, "timeout", {}});
  EXPECT_TRUE(FailedEpisodesText(failed, "a", 80, false).ends_with("and 1 more\n"));
}

TEST(PolicyFailuresText, HasACommandForEach) {
  EXPECT_EQ(PolicyFailuresText({}, 80, false), "");
  EXPECT_EQ(PolicyFailuresText({{"noisy", "plan/noisy/lift_pot-base", {3, "timeout", {}}},
                                {"a", "plan/a/lift_pot-base", {0, "timeout", {"", 1, "It fell down."}}}},
                               80, false),
            "failures, one of each policy\n"
            "noisy  time limit                evalbus web plan/noisy/lift_pot-base --episode 3\n"
            "a      time limit                evalbus web plan/a/lift_pot-base --episode 0\n"
            "       It fell down.\n");
}

TEST(SummaryTable, FitsEveryWidth) {
  for (const int width : {50, 60, 70, 80, 100}) {
    const std::string text = SummaryTable(Summary(2, 1), width);
    EXPECT_LE(LongestLine(text), width) << text;
    const size_t end = text.find("not shown at ");
    ASSERT_NE(end, std::string::npos) << text;
    const std::string table = text.substr(0, end), omitted = text.substr(end);
    EXPECT_TRUE(Has(table, "mean")) << width;
    EXPECT_EQ(Has(table, "interval"), true) << table;
    EXPECT_EQ(Has(table, "median"), width >= 80) << table;
    EXPECT_FALSE(Has(table, " \n")) << table;
    EXPECT_EQ(Has(omitted, "median"), width < 80) << omitted;
    EXPECT_TRUE(Has(omitted, "max (see")) << omitted;
    EXPECT_EQ(Has(omitted, "episodes.jsonl"), width < 100) << omitted;
  }
  EXPECT_FALSE(Has(SummaryTable(Summary(2, 1), 120), "not shown"));
}

TEST(SummaryTable, RemarksThatEqualEpisodesAreOneSample) {
  metrics::RunSummary summary = Summary(3, 3);
  EXPECT_FALSE(Has(SummaryTable(summary, 80), "Note: "));
  summary.samples = 1;
  EXPECT_TRUE(Has(SummaryTable(summary, 80), "Note: all 3 episodes have equal starts and equal numbers"))
      << SummaryTable(summary, 80);
}

TEST(SummaryTable, StatesTheExclusions) {
  metrics::RunSummary summary = Summary(2, 1);
  summary.episodes = 5;
  EXPECT_TRUE(Has(SummaryTable(summary, 80), "3 of 5 episodes incomplete"));
  const std::string none = SummaryTable(Summary(0, 0), 80);
  EXPECT_EQ(none, "");
  summary.complete = summary.samples = 0;
  EXPECT_EQ(SummaryTable(summary, 80), "5 of 5 episodes incomplete: excluded from all numbers here\n");
  summary.invalid = 2;
  EXPECT_EQ(SummaryTable(summary, 80),
            "2 of 5 episodes invalid: excluded from all numbers here\n3 of 5 episodes incomplete: excluded "
            "from all numbers here\n");
  summary.invalid = 5;
  EXPECT_EQ(SummaryTable(summary, 80), "5 of 5 episodes invalid: excluded from all numbers here\n");
}

TEST(SuccessText, HasTheConditionsOfTheCause) {
  const std::string cause = "Success at 6.18 s: height of pot 1.097 m, tilt of pot 0.31 degrees.";
  EXPECT_EQ(SuccessText(cause), "height of pot 1.097 m, tilt of pot 0.31 degrees");
  EXPECT_EQ(SuccessText(cause, 30), "height of pot 1.097 m");
  EXPECT_EQ(SuccessText("Success at 6.18 s."), "");
  EXPECT_EQ(SuccessText(""), "");
}

TEST(EpisodeLine, EndsWithTheConditionsOfASuccessIfThereIsRoom) {
  nlohmann::ordered_json episode = {{"episode", 3},
                                    {"failure_reason", ""},
                                    {"end_reason", "success"},
                                    {"end_detail", ""},
                                    {"complete", true},
                                    {"metrics", {{"completion_time", 5}}},
                                    {"extended", nlohmann::ordered_json::object()},
                                    {"cause", {{"text", "Success at 5.00 s: height of pot 1.097 m, x 1."}}}};
  EXPECT_TRUE(EpisodeLine(episode, 200).ends_with("  height of pot 1.097 m, x 1"))
      << EpisodeLine(episode, 200);
  EXPECT_FALSE(Has(EpisodeLine(episode, 200), "0/0")) << "the stages are unknown";
  const std::string columns = EpisodeHeader(200);
  const int width = static_cast<int>(columns.size() + 2 + std::string("height of pot 1.097 m").size());
  EXPECT_TRUE(EpisodeLine(episode, width).ends_with("  height of pot 1.097 m"))
      << EpisodeLine(episode, width);
  EXPECT_FALSE(Has(EpisodeLine(episode, width - 1), "height"));
  EXPECT_TRUE(EpisodeLine(episode, width, true).ends_with("  height of pot 1.097 m"));
  episode["cause"] = nullptr;
  EXPECT_FALSE(Has(EpisodeLine(episode, 200), "height"));
}

TEST(EpisodeLine, NamesTheFirstViolationOfAForceLimit) {
  nlohmann::ordered_json episode = {{"episode", 3},
                                    {"failure_reason", ""},
                                    {"end_reason", "success"},
                                    {"end_detail", ""},
                                    {"complete", true},
                                    {"metrics", {{"completion_time", 5}}},
                                    {"extended", {{"limit_violations", 0}}},
                                    {"explanation", {{"text", "success"}}}};
  EXPECT_FALSE(Has(EpisodeLine(episode, 80), "violation"));
  const nlohmann::ordered_json first = {{"region", "hand"}, {"force_N", 310.4}, {"time_s", 1.24}};
  episode["explanation"]["limit_violations"] = {first, {{"region", "arm"}, {"force_N", 9}, {"time_s", 2}}};
  EXPECT_TRUE(EpisodeLine(episode, 80)
                  .ends_with("  2 violations of force limits, first of hand at 1.24 s with 310 N"))
      << EpisodeLine(episode, 80);
}

TEST(InvalidText, ExplainsHowToRunThemAgain) {
  EXPECT_EQ(InvalidText(0, "runs/a"), "");
  EXPECT_EQ(
      InvalidText(1, "runs/a"),
      "1 episode is invalid because the policy's server failed; the same command with --out runs/a --resume "
      "runs it again\n");
  EXPECT_TRUE(InvalidText(2, "runs/a").starts_with("2 episodes are invalid")) << InvalidText(2, "runs/a");
}

}  // namespace evalbus::results::summary_table_test
