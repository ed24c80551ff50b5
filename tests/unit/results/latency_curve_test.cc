#include "results/latency_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "base/run_layout.h"
#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::latency_curve_test {

using nlohmann::ordered_json;
using testing::HasSubstr;
using testing::Not;

class LatencyCurveTest : public testing::Test {
 protected:
  // Three of four episodes succeed, after 3, 4 and 5 s.
  RecordedRun Run(const ordered_json& more) {
    ordered_json info = RunInfo(4);
    info.update(more);
    std::vector<ordered_json> lines;
    for (int i = 0; i < 4; ++i) {
      ordered_json& line = lines.emplace_back(
          EpisodeLine(i, i < 3, {{"completion_time", 3 + i}, {"overall_rms_joint_jerk", 10.0 * (i + 1)}}));
      line["extended"].update({{"stale_action_ratio", 0.1 * (i + 1)},
                               {"effective_hz", 45 - 5 * i},
                               {"action_age_s", 0.05 * (i + 1)}});
    }
    const auto folder = folder_.path() / "run";
    WriteRun(folder, info, lines);
    return ReadRun(folder);
  }
  TemporaryFolder folder_;
};

TEST_F(LatencyCurveTest, HasTheNumbersOfARun) {
  const DelayPoint point = ReadDelayPoint(Run({{"latency", "90"}, {"execution", "rtc"}}));
  EXPECT_EQ(point.execution, "rtc");
  EXPECT_EQ(point.delay_ms, 90);
  EXPECT_EQ(point.delay_ticks, 5);
  EXPECT_DOUBLE_EQ(point.applied_ms, 100);
  EXPECT_EQ(point.complete, 4);
  EXPECT_EQ(point.success.mean, 0.75);
  EXPECT_EQ(point.completion_time_s.mean, 4);
  EXPECT_EQ(point.joint_jerk_radps3.mean, 25);
  EXPECT_DOUBLE_EQ(point.stale_action_ratio, 0.25);
  EXPECT_EQ(point.effective_hz, 37.5);
  EXPECT_DOUBLE_EQ(point.action_age_s, 0.125);

  const std::vector<DelayPoint> points = {point};
  EXPECT_THAT(DelayTable(points), HasSubstr("rtc                100         4  75 ("));
  EXPECT_EQ(DelayJson(points)[0]["success_rate"]["mean"], 0.75);
  const std::string csv = DelayCsv(points);
  EXPECT_EQ(std::ranges::count(csv, '\n'), 2);
  EXPECT_EQ(std::ranges::count(csv, ','), 2 * 16);
  EXPECT_THAT(csv, HasSubstr("success_rate.upper"));
}

TEST_F(LatencyCurveTest, WithoutCompleteEpisodesHasDashes) {
  const auto folder = folder_.path() / "none";
  ordered_json info = RunInfo(4);
  info["latency"] = "90";
  ordered_json line = EpisodeLine(0, false, {});
  line["complete"] = false;
  WriteRun(folder, info, {line});
  const std::vector<DelayPoint> points = {ReadDelayPoint(ReadRun(folder))};
  EXPECT_THAT(DelayTable(points), HasSubstr("  -"));
  EXPECT_THAT(DelayTable(points), Not(HasSubstr("nan")));
  EXPECT_EQ(
      DelayHeadline(points, {}),
      std::vector<std::string>{"No conclusion, because no episode with a delay of 100 ms has a verdict."});
}

class DelayHeadlineTest : public testing::Test {
 protected:
  // Adds a run whose first `successes` episodes succeed.
  void Add(const std::string& execution, int delay_ms, int successes, int episodes = 20) {
    ordered_json info = RunInfo(episodes);
    info.update({{"latency", std::to_string(delay_ms)},
                 {"execution", execution},
                 {"task_sha256", "task"},
                 {"physics_sha256", "model"}});
    std::vector<ordered_json> lines;
    for (int i = 0; i < episodes; ++i)
      lines.push_back(EpisodeLine(i, i < successes, {{"completion_time", 3 + 0.1 * i}}));
    const auto folder = folder_.path() / (execution + std::to_string(delay_ms));
    WriteRun(folder, info, lines);
    runs_.push_back(ReadRun(folder));
    points_.push_back(ReadDelayPoint(runs_.back()));
  }
  std::vector<std::string> Lines() const { return DelayHeadline(points_, CompareDelays(points_, runs_)); }

  TemporaryFolder folder_;
  std::vector<RecordedRun> runs_;
  std::vector<DelayPoint> points_;
};

// 12 pairs in which only one side succeeded have p = 2 / 2^12, times 2 by Holm's method.
TEST_F(DelayHeadlineTest, NamesTheDelaysThatCostSuccess) {
  Add("synchronous", 0, 16);
  Add("synchronous", 300, 4);
  Add("synchronous", 100, 15);
  EXPECT_THAT(
      Lines(),
      testing::ElementsAre(
          "Success is lower with 300 ms (20 %) than with 0 ms (80 %); not shown to differ with 100 ms.",
          "Test: exact McNemar on equal seeds, p adjusted with Holm's method for 2 comparisons."));
}

TEST_F(DelayHeadlineTest, HasALineForEachExecutionMode) {
  Add("synchronous", 0, 16);
  Add("synchronous", 100, 15);
  Add("rtc", 0, 16);
  Add("rtc", 100, 16);
  EXPECT_THAT(Lines(),
              testing::ElementsAre(
                  "synchronous: success is not shown to depend on the delay: 75 to 80 % with 0 to 100 ms.",
                  "rtc: success is not shown to depend on the delay: 80 % with 0 to 100 ms.",
                  "Test: exact McNemar on equal seeds, p adjusted with Holm's method for 2 comparisons."));
}

// For three comparisons, 2 / 2^7 is the first p below 0.05 / 3.
TEST_F(DelayHeadlineTest, StatesHowManyPairsAreNeeded) {
  Add("rtc", 0, 4, 4);
  for (const int delay_ms : {100, 200, 300}) Add("rtc", delay_ms, 0, 4);
  EXPECT_THAT(Lines(), testing::ElementsAre(
                           "Success is not shown to depend on the delay: 0 to 100 % with 0 to 300 ms.",
                           HasSubstr("exact McNemar"),
                           "4 pairs cannot show that success depends on the delay: at least 7 are needed."));
}

TEST_F(DelayHeadlineTest, OneDelayIsComparedWithNothing) {
  Add("rtc", 100, 5);
  EXPECT_THAT(Lines(), testing::ElementsAre("Success with a delay of 100 ms: 25 %."));
}

TEST_F(LatencyCurveTest, ARunWithoutAFixedDelayHasNoPoint) {
  EXPECT_THROW(ReadDelayPoint(Run({{"latency", "none"}})), InputError);
  EXPECT_THROW(ReadDelayPoint(Run({{"latency", "measured"}})), InputError);
}

}  // namespace evalbus::results::latency_curve_test
