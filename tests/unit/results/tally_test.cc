#include "results/tally.h"

#include <gtest/gtest.h>

#include "results/run_summary.h"
#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::tally_test {

class TallyTest : public testing::Test {
 protected:
  RecordedRun Run(const std::string& name, const std::vector<nlohmann::ordered_json>& episodes) {
    WriteRun(folder_.path() / name, RunInfo(static_cast<int>(episodes.size())), episodes);
    return ReadRun(folder_.path() / name);
  }
  static nlohmann::ordered_json Took(int episode, double time, bool success = true) {
    return EpisodeLine(episode, success, {{"completion_time", time}});
  }

  TemporaryFolder folder_;
};

TEST_F(TallyTest, PoolsRunsInWhateverOrder) {
  const RecordedRun a = Run("a", {Took(0, 1), Took(1, 2, false)}), b = Run("b", {Took(0, 3), Took(1, 4)});
  Tally ab, ba;
  ab.Add(a);
  ab.Add(b);
  ba.Add(b);
  ba.Add(a);
  EXPECT_EQ(ab.Json().dump(), ba.Json().dump());
  EXPECT_EQ(ab.Json()["complete"], 4);
  EXPECT_EQ(ab.Json()["successes"], 3);
  EXPECT_DOUBLE_EQ(ab.Json()["mean_completion_time_s"], 8.0 / 3);  // over successes
  EXPECT_EQ(ab.Json()["failure_reasons"].dump(), R"({"timeout":1})");
  EXPECT_EQ(Tally::Title("task", 6), "task      success   95 % interval  success time  remarks\n");
  EXPECT_EQ(ab.Line("all", 6), "all        3 of 4      30 to 95 %        2.67 s  1 time limit\n");
  // 202 is the color of failures (base/styled_text.cc).
  EXPECT_TRUE(ab.Line("all", 6, true).ends_with("  \x1b[38;5;202m1 time limit\x1b[0m\n"));
  EXPECT_TRUE(Tally::Title("task", 6, true).starts_with("\x1b[1mtask  "));
}

TEST_F(TallyTest, WhatIsNotCompleteIsNoFailure) {
  auto incomplete = Took(1, 2, false);
  incomplete["complete"] = false;
  Tally tally;
  tally.Add(Run("a", {Took(0, 1), incomplete}));
  EXPECT_EQ(tally.Line("a", 1), "a     1 of 1     21 to 100 %        1.00 s  1 incomplete\n");
  EXPECT_FALSE(tally.Json().contains("invalid"));
  auto invalid = incomplete;
  invalid["end_reason"] = invalid["failure_reason"] = "server_error";
  Tally with;
  with.Add(Run("b", {Took(0, 1), invalid}));
  EXPECT_EQ(with.Line("b", 1), "b     1 of 1     21 to 100 %        1.00 s  1 invalid\n");
  EXPECT_EQ(with.Summary().invalid, 1);
  EXPECT_EQ(with.Json()["invalid"], 1);
  EXPECT_EQ(with.Json()["failure_reasons"].dump(), R"({"invalid":1})");
}

TEST_F(TallyTest, EqualEpisodesAreOneSample) {
  Tally tally;
  tally.Add(Run("a", {Took(0, 1), Took(1, 1), Took(2, 1)}));
  EXPECT_EQ(tally.Line("a", 1),
            "a     3 of 3     21 to 100 %        1.00 s  equal episodes: the interval counts 1\n");
}

TEST_F(TallyTest, TheMeanOfTasksCountsEachTaskAlike) {
  SuiteTally tally;
  tally.Add("lift_pot/position", Run("a", {Took(0, 1), Took(1, 2), Took(2, 3), Took(3, 4)}));
  EXPECT_EQ(tally.MeanLine(4), "");
  tally.Add("lift_pot/base", Run("b", {Took(0, 9, false)}));
  EXPECT_DOUBLE_EQ(tally.Json({})["all"]["success_rate"], 0.8);
  EXPECT_DOUBLE_EQ(tally.Json({})["all"]["mean_success_rate_of_tasks"], 0.5);
  EXPECT_EQ(tally.MeanLine(4),
            "mean of tasks       50 %  all tasks have equal weight; in \"all\", all complete episodes do\n");
}

TEST_F(TallyTest, WithoutEpisodesNothingIsClaimed) {
  EXPECT_EQ(Tally().Line("a", 1), "a     0 of 0      0 to 100 %             -\n");
  EXPECT_TRUE(Tally().Json()["mean_completion_time_s"].is_null());
}

}  // namespace evalbus::results::tally_test
