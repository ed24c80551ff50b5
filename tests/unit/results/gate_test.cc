#include "results/gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/results/compare_fixture.h"

namespace evalbus::results::gate_test {

using nlohmann::ordered_json;
using testing::ElementsAre;
using testing::HasSubstr;

class GateTest : public CompareTest {
 protected:
  // Returns a run in which the first episodes succeed. `change` and `change_info` may edit lines and
  // run.json.
  RecordedRuns Of(const std::string& name, int successes, int episodes,
                  const std::function<void(int, ordered_json*)>& change = {},
                  const std::function<void(ordered_json*)>& change_info = {}) {
    ordered_json info = Info(episodes);
    if (change_info) change_info(&info);
    std::vector<ordered_json> lines;
    for (int i = 0; i < episodes; ++i) {
      lines.push_back(EpisodeLine(i, i < successes, {{"completion_time", 4 + 0.01 * i}, {"slip_count", 0}}));
      // The initial states differ, so each episode is a sample.
      lines.back()["parameters"] = {{"pot_x_m", 0.001 * i}};
      if (change) change(i, &lines.back());
    }
    std::erase_if(lines, [](const ordered_json& line) { return line.is_null(); });
    WriteRun(folder_.path() / name, info, lines);
    return ReadRuns(folder_.path() / name);
  }
  std::string RefusalOf(const RecordedRuns& run, const RecordedRuns& baseline,
                        const GateOptions& options = {}) {
    try {
      Decide(run, baseline, options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

// 59 pairs without a loss are needed, because 0.95^58 > 0.05 > 0.95^59.
TEST_F(GateTest, EqualRunsPassFromFiftyNinePairsOn) {
  const Gate few = Decide(Of("a58", 50, 58), Of("b58", 50, 58), {});
  EXPECT_EQ(few.verdict, GateVerdict::kCannotTell);
  EXPECT_EQ(few.criteria[0].more_pairs, 1);
  EXPECT_THAT(few.why, HasSubstr("about 1 more pair would decide"));
  const Gate enough = Decide(Of("a59", 50, 59), Of("b59", 50, 59), {});
  EXPECT_EQ(enough.verdict, GateVerdict::kPass);
  EXPECT_EQ(
      GateText(enough),
      "PASS  a59 against b59: success 84.7 -> 84.7 % in 59 pairs: a loss of at most 4.96 points "
      "(one-sided 95 % bound), margin 5 points\n\n"
      "note: lift_pot/position: all numbers of 59 pairs are equal on both sides, as if one policy had run "
      "twice\n");
}

// In binary, 0.9 - 0.7 is greater than 0.2.
TEST_F(GateTest, AConstantLossEqualToTheMarginPasses) {
  const auto with = [](double slips) {
    return [slips](int, ordered_json* line) { (*line)["metrics"]["slip_count"] = slips; };
  };
  const RecordedRuns run = Of("a", 100, 100, with(0.9)), baseline = Of("b", 100, 100, with(0.7));
  const auto verdict = [&](const char* margin) {
    GateOptions options;
    options.on = {std::string("slips:") + margin};
    return Decide(run, baseline, options).criteria.at(1).verdict;
  };
  EXPECT_EQ(verdict("0.2"), GateVerdict::kPass);
  EXPECT_EQ(verdict("0.1999"), GateVerdict::kFail);
}

TEST_F(GateTest, ALossBeyondTheMarginFails) {
  const Gate gate = Decide(Of("a", 30, 60), Of("b", 60, 60), {});
  EXPECT_EQ(gate.verdict, GateVerdict::kFail);
  EXPECT_DOUBLE_EQ(gate.criteria[0].loss, 50);
  EXPECT_GT(gate.criteria[0].loss_lower, 35);
  EXPECT_EQ(gate.tasks[0].lost, 30);
  EXPECT_EQ(gate.tasks[0].gained, 0);
  EXPECT_THAT(gate.why, testing::StartsWith("success 100.0 -> 50.0 % in 60 pairs: a loss of at least "));
}

TEST_F(GateTest, ALossThatIsNotShownCannotTell) {
  const Gate gate = Decide(Of("a", 55, 60), Of("b", 60, 60), {});
  EXPECT_EQ(gate.verdict, GateVerdict::kCannotTell);
  const std::string words = "the loss is between ";
  ASSERT_THAT(gate.why, HasSubstr(words));
  // The bounds are rounded outward.
  double lower = 0, upper = 0;
  ASSERT_EQ(std::sscanf(gate.why.c_str() + gate.why.find(words) + words.size(), "%lf points and %lf", &lower,
                        &upper),
            2);
  EXPECT_LE(lower, gate.criteria[0].loss_lower);
  EXPECT_GE(upper, gate.criteria[0].loss_upper);
  EXPECT_NEAR(lower, gate.criteria[0].loss_lower, 0.1);
  EXPECT_NEAR(upper, gate.criteria[0].loss_upper, 0.1);
}

// The margin has no decimals, but the bounds have one, or more if the bound would be shown as the margin.
TEST(LossText, HasDecimalsThatTheMarginLacks) {
  GateCriterion criterion;
  criterion.margin = 10;
  criterion.unit = "points";
  EXPECT_EQ(LossText(criterion, 9.51, BoundFrom::kAbove), "9.6 points");
  EXPECT_EQ(LossText(criterion, 30.76, BoundFrom::kBelow), "30.7 points");
  EXPECT_EQ(LossText(criterion, 9.951, BoundFrom::kAbove), "9.96 points");
  EXPECT_EQ(LossText(criterion, 10.0049, BoundFrom::kBelow), "10.004 points");
  EXPECT_EQ(LossText(criterion, 10, BoundFrom::kAbove), "10.0 points");
}

TEST(WhyText, NamesABoundBelowZeroAGain) {
  GateCriterion criterion;
  criterion.pairs = 12;
  criterion.margin = 10;
  criterion.unit = "points";
  criterion.fail_alpha = metrics::kAlpha;
  criterion.verdict = GateVerdict::kCannotTell;
  const auto why = [&](double lower, double upper) {
    criterion.loss_lower = lower;
    criterion.loss_upper = upper;
    return WhyText(criterion);
  };
  EXPECT_THAT(why(-22.36, 90.25),
              HasSubstr(": between a gain of 22.4 points and a loss of 90.3 points (one-"));
  EXPECT_THAT(why(3.06, 17.4), HasSubstr(": the loss is between 3.0 points and 17.4 points (one-sided 95 %"));
  EXPECT_THAT(why(-17.4, -3.06), HasSubstr(": the gain is between 3.0 points and 17.4 points (one-sided"));
}

TEST_F(GateTest, APolicyThatCommandedNothingCannotPass) {
  GateOptions options;
  options.has_commanded_motion = false;
  const Gate gate = Decide(Of("a", 100, 100), Of("b", 100, 100), options);
  EXPECT_EQ(gate.verdict, GateVerdict::kCannotTell);
  EXPECT_EQ(gate.why, "no log of a shows that the policy commanded a motion; such a run cannot pass");
}

TEST_F(GateTest, APolicyThatNeverSucceedsCannotPass) {
  const Gate gate = Decide(Of("a", 0, 200), Of("b", 0, 200), {});
  EXPECT_EQ(gate.verdict, GateVerdict::kCannotTell);
  EXPECT_EQ(gate.why, "a succeeded in none of 200 episodes; such a run cannot pass");
}

// 100 pairs without a loss pass. If 4 of them are incomplete and may be losses, they do not.
TEST_F(GateTest, IncompleteEpisodesCountAgainstThePass) {
  const auto incomplete = [](int i, ordered_json* line) {
    if (i < 4) (*line)["complete"] = false;
  };
  const Gate gate = Decide(Of("a", 100, 100, incomplete), Of("b", 100, 100), {});
  EXPECT_EQ(gate.verdict, GateVerdict::kCannotTell);
  EXPECT_EQ(gate.criteria[0].pairs, 96);
  EXPECT_THAT(GateText(gate), HasSubstr("4 pairs without a complete result on at least one side"));
  EXPECT_EQ(Decide(Of("c", 100, 100), Of("d", 100, 100), {}).verdict, GateVerdict::kPass);
}

// The missing episodes may be exactly those that would have failed, for example because the run crashed.
TEST_F(GateTest, EpisodesThatNeverRanCountAgainstThePass) {
  const auto missing = [](int i, ordered_json* line) {
    if (i >= 80) *line = nullptr;
  };
  const Gate gate = Decide(Of("a", 80, 100, missing), Of("b", 100, 100), {});
  EXPECT_EQ(gate.verdict, GateVerdict::kCannotTell);
  EXPECT_THAT(GateText(gate), HasSubstr("20 pairs without"));
}

// Both runs were stopped before their last 20 episodes.
TEST_F(GateTest, EpisodesThatNeitherRunHasCountAgainstThePass) {
  const auto missing = [](int i, ordered_json* line) {
    if (i >= 80) *line = nullptr;
  };
  const Gate gate = Decide(Of("a", 80, 100, missing), Of("b", 80, 100, missing), {});
  EXPECT_EQ(gate.verdict, GateVerdict::kCannotTell);
  EXPECT_THAT(GateText(gate), HasSubstr("20 pairs without"));
  // Episodes that were planned for only one of the two runs are not pairs.
  EXPECT_THAT(GateText(Decide(Of("c", 80, 90, missing), Of("d", 80, 100, missing), {})),
              HasSubstr("10 pairs without"));
  EXPECT_EQ(Decide(Of("e", 80, 80), Of("f", 80, 100, missing), {}).verdict, GateVerdict::kPass);
}

TEST_F(GateTest, EpisodesThatWereNotPlannedAreExcluded) {
  const Gate gate = Decide(Of("a", 60, 60), Of("b", 100, 100), {});
  EXPECT_EQ(gate.verdict, GateVerdict::kPass);
  EXPECT_EQ(gate.criteria[0].pairs, 60);
  EXPECT_THAT(GateText(gate), HasSubstr("excluded because the other run lacks them"));
}

// Episodes with equal initial states and equal numbers are one sample.
TEST_F(GateTest, RepetitionsAreOneSample) {
  const auto same = [](int, ordered_json* line) {
    (*line)["parameters"] = ordered_json::object();
    (*line)["metrics"]["completion_time"] = 4;
  };
  EXPECT_EQ(Decide(Of("a", 100, 100, same), Of("b", 100, 100, same), {}).verdict, GateVerdict::kCannotTell);
}

// The run has one slip more in every second of 100 pairs: a mean loss of 0.5 slips with a standard error of
// 0.05.
TEST_F(GateTest, MetricsHaveMarginsOfTheirOwn) {
  const auto slipping = [](int i, ordered_json* line) { (*line)["metrics"]["slip_count"] = i % 2; };
  const RecordedRuns run = Of("a", 100, 100, slipping), baseline = Of("b", 100, 100);
  const auto decide = [&](const std::string& on) {
    GateOptions options;
    options.on = {on};
    return Decide(run, baseline, options).criteria.at(1);
  };
  const GateCriterion within = decide("slips:0.7");
  EXPECT_EQ(within.verdict, GateVerdict::kPass);
  EXPECT_NEAR(within.loss, 0.5, 1e-12);
  // t(99 degrees, 97.5 %) = 1.9842.
  EXPECT_NEAR(within.loss_upper, 0.5 + 1.9842 * std::sqrt(0.25 / 99), 1e-4);
  EXPECT_EQ(decide("slip_count:0.3").verdict, GateVerdict::kFail);
  EXPECT_EQ(decide("slips:0.45").verdict, GateVerdict::kCannotTell);
  // A margin in percent is undefined if the baseline has no slips.
  EXPECT_THAT(decide("slips").why, HasSubstr("the baseline's mean is 0"));
}

TEST_F(GateTest, MarginsOfSharesAreInPointsOrRelative) {
  const auto stuck = [](int i, ordered_json* line) {
    (*line)["metrics"]["subtask_progress"] = i % 2 == 0 ? 0.5 : 0.75;
  };
  const auto decide = [&](const std::string& on) {
    GateOptions options;
    options.on = {on};
    return Decide(Of("a", 0, 100, stuck), Of("b", 0, 100, stuck), options).criteria.at(1);
  };
  EXPECT_EQ(decide("subtask_progress:20").unit, "points");
  EXPECT_EQ(decide("subtask_progress:20%").unit, "%");
}

// With few differing pairs, the number of missing pairs leaves a reserve: 40 * (10 + 0.84 * sqrt(10)) / 5 is
// 101.2.
TEST_F(GateTest, FewDifferingPairsNeedMore) {
  const auto slipping = [](int i, ordered_json* line) { (*line)["metrics"]["slip_count"] = i % 8 == 0; };
  GateOptions options;
  options.on = {"slips:0.5"};
  const GateCriterion slips = Decide(Of("a", 40, 40, slipping), Of("b", 40, 40), options).criteria.at(1);
  EXPECT_EQ(slips.verdict, GateVerdict::kCannotTell);
  EXPECT_EQ(slips.more_pairs, 102 - 40);
}

// The run takes 20 % longer in every pair.
TEST_F(GateTest, MarginsInPercentAreOfTheBaseline) {
  const auto slower = [](int, ordered_json* line) {
    ordered_json& time = (*line)["metrics"]["completion_time"];
    time = 1.2 * time.get<double>();
  };
  const auto decide = [&](const std::string& on) {
    GateOptions options;
    options.on = {"success", on};
    return Decide(Of("a", 90, 100, slower), Of("b", 90, 100), options);
  };
  const Gate fails = decide("completion_time:10%");
  EXPECT_EQ(fails.verdict, GateVerdict::kFail);
  EXPECT_EQ(fails.criteria.at(1).pairs, 90);
  EXPECT_NEAR(fails.criteria.at(1).loss, 20, 1e-9);
  EXPECT_THAT(fails.why, HasSubstr("in 90 pairs in which both succeeded: a loss of at least "));
  std::filesystem::remove_all(folder_.path() / "a");
  EXPECT_EQ(decide("completion_time:30%").verdict, GateVerdict::kPass);
}

// The bound of the loss is far below the margin.
TEST_F(GateTest, ASmallLossIsNotShownAsNone) {
  const auto late = [](int i, ordered_json* line) {
    (*line)["extended"]["tracking_error_rad"] = {{"left", 0.001 * (i % 2)}};
  };
  const auto none = [](int, ordered_json* line) {
    (*line)["extended"]["tracking_error_rad"] = {{"left", 0.0}};
  };
  GateOptions options;
  options.on = {"tracking_error_rad.left:1"};
  const Gate gate = Decide(Of("a", 100, 100, late), Of("b", 100, 100, none), options);
  // 0.0005 + 1.98 * 0.00005 rad.
  EXPECT_THAT(gate.criteria.at(1).why, HasSubstr(": a loss of at most 0.0006 rad (one-sided 95 % bound)"));
}

TEST_F(GateTest, UnusableMetricsAreRefused) {
  const auto idle = [](int, ordered_json* line) {
    (*line)["extended"]["idle_time_s"] = {{"left", 1}, {"right", 2}};
  };
  const RecordedRuns run = Of("a", 60, 60, idle), baseline = Of("b", 60, 60, idle);
  const auto refusal = [&](const std::string& on) {
    GateOptions options;
    options.on = {on};
    return RefusalOf(run, baseline, options);
  };
  EXPECT_THAT(refusal("slip_cont"), HasSubstr("--on slip_cont: no such metric in both runs; did you mean"));
  EXPECT_THAT(refusal("unheard_of"), HasSubstr("; expected one of "));
  EXPECT_THAT(refusal("idle_time_s:1"),
              HasSubstr("matches several metrics: extended.idle_time_s.left, extended.idle_time_s.right"));
  EXPECT_THAT(refusal("idle_time.left"), HasSubstr("did you mean 'idle_time_s.left'"));
  EXPECT_THAT(refusal("slips:x"), HasSubstr("margin 'x': expected a number"));
  EXPECT_THAT(refusal("slips:-1"), HasSubstr("margin '-1': expected a number"));
  EXPECT_THAT(refusal("success:3"), HasSubstr("--margin is the margin of success"));
}

TEST_F(GateTest, UnusableRunsAreRefused) {
  const RecordedRuns baseline = Of("b", 60, 60);
  const auto with = [](const char* key, const ordered_json& value) {
    return [=](ordered_json* info) { (*info)[key] = value; };
  };
  EXPECT_THAT(RefusalOf(Of("until", 60, 60, {}, with("until", "decided(0.05)")), baseline),
              HasSubstr("its plan stopped depending on its results (until: decided(0.05))"));
  EXPECT_THAT(RefusalOf(Of("watched", 60, 60, {}, with("watch", true)), baseline),
              HasSubstr("not simulated by evalbus"));
  EXPECT_THAT(RefusalOf(Of("task", 60, 60, {}, with("task_sha256", "other")), baseline),
              HasSubstr("different descriptions of the task"));
  WriteFile(folder_.path() / "collected" / "collect.json", "{}");
  EXPECT_THAT(RefusalOf(Of("collected", 60, 60), baseline), HasSubstr("only successes were kept"));
  EXPECT_THAT(RefusalOf(Run("seed", Info(60, 8), First(60, 60), 4), baseline),
              HasSubstr("no seed in common"));
  const auto incomplete = [](int, ordered_json* line) { (*line)["complete"] = false; };
  EXPECT_THAT(RefusalOf(Of("invalid", 60, 60, incomplete), baseline),
              HasSubstr("invalid: no complete episode"));
}

TEST_F(GateTest, ATaskThatTheRunLacksIsRefused) {
  Of("suite/position", 60, 60);
  ordered_json info = Info(1);
  info["variation"] = "base";
  ordered_json line = EpisodeLine(0);
  line["variation"] = "base";
  WriteRun(folder_.path() / "suite/base", info, {line});
  WriteFile(folder_.path() / "suite/suite.json", R"({"runs": ["position", "base"]})");
  const RecordedRuns suite = ReadRuns(folder_.path() / "suite");
  EXPECT_THAT(RefusalOf(Of("a", 60, 60), suite),
              HasSubstr("lift_pot/base is not in a: a gate requires all tasks of the baseline"));
}

TEST_F(GateTest, ATaskWithoutAFinishedEpisodeIsRefused) {
  for (const std::string name : {"a", "b"}) {
    Of(name + "/position", 60, 60);
    WriteRun(folder_.path() / name / "base", Info(60), {});
    WriteFile(folder_.path() / name / "suite.json", R"({"runs": ["position", "base"]})");
  }
  EXPECT_THAT(RefusalOf(ReadRuns(folder_.path() / "a"), ReadRuns(folder_.path() / "b")),
              HasSubstr("b/base has no finished episode: a gate requires all tasks of the baseline"));
}

}  // namespace evalbus::results::gate_test
