#include "results/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "lcmtypes/end_reason.h"
#include "results/comparability.h"
#include "results/comparison_json.h"
#include "results/comparison_text.h"
#include "results/conclusion.h"
#include "tests/unit/longest_line.h"
#include "tests/unit/results/compare_fixture.h"

namespace evalbus::results::comparison_test {

using nlohmann::ordered_json;
using testing::Contains;
using testing::Not;

TEST_F(CompareTest, PairsBySeed) {
  // 28 of 50 seeds succeed in both runs, 15 only in b, 3 only in a.
  std::vector<bool> in_a(50), in_b(50);
  for (size_t i = 0; i < 50; ++i) {
    in_a[i] = i < 31;
    in_b[i] = i < 28 || (i >= 31 && i < 46);
  }
  const Comparison result = CompareRuns(Run("b", Info(50), in_b, 6), Run("a", Info(50), in_a, 5));
  const SuccessComparison& success = result.success;
  EXPECT_TRUE(success.paired);
  EXPECT_EQ(success.successes, 43);
  EXPECT_EQ(success.baseline_successes, 31);
  EXPECT_EQ(success.pairs.both, 28);
  EXPECT_EQ(success.pairs.only_a, 15);
  EXPECT_EQ(success.pairs.only_b, 3);
  EXPECT_EQ(success.pairs.neither, 4);
  // Where both succeeded, b took more time.
  EXPECT_EQ(success.ahead.a, 15);
  EXPECT_EQ(success.ahead.b, 3 + 28);
  EXPECT_DOUBLE_EQ(success.difference, 0.24);
  EXPECT_NEAR(success.p, 0.0075378, 5e-8);  // scipy's binomtest(3, 18)
  const metrics::Interval expected = metrics::NewcombePairedInterval(success.pairs);
  EXPECT_EQ(success.difference_95.lower, expected.lower);
  EXPECT_EQ(
      Conclusion(result),
      "b is 24 points better than a, 95 % CI 8 to 39. 43 of 50 against 31 of 50 on the same seeds, exact "
      "McNemar p = 0.008.");

  ASSERT_EQ(result.tasks.size(), 1u);
  const std::vector<MetricComparison>& metrics = result.tasks[0].metrics;
  ASSERT_EQ(metrics.size(), 3u);
  // Effort is compared where both succeeded. The run needs one second more in each of these pairs.
  EXPECT_EQ(metrics[0].number.name, "completion_time");
  EXPECT_EQ(metrics[0].count, 28);
  EXPECT_NEAR(metrics[0].difference, 1, 1e-12);
  EXPECT_LT(*metrics[0].p, 1e-7);
  EXPECT_EQ(metrics[0].p_holm, *metrics[0].p);  // the only metric with a p
  EXPECT_GT(*metrics[0].ratio, 1);
  // The slip counts are equal everywhere, so there is nothing to test.
  EXPECT_EQ(metrics[2].number.name, "slip_count");
  EXPECT_EQ(metrics[2].count, 50);
  EXPECT_FALSE(metrics[2].p);

  const std::string text = ComparisonText(result, true);
  EXPECT_NE(text.find("worse"), std::string::npos) << text;
  EXPECT_NE(text.find("Effort relative to a"), std::string::npos) << text;
  const ordered_json json = ComparisonJson({result});
  EXPECT_EQ(json["comparisons"][0]["success"]["pairs"]["run_only"], 15);
  // Flipped seeds: on 15 only the run succeeds, and on 3 only the baseline does.
  const ordered_json& flipped = json["comparisons"][0]["tasks"][0]["flipped"];
  ASSERT_EQ(flipped.size(), 18u);
  int of_run = 0;
  for (const ordered_json& pair : flipped) {
    const int episode = pair["episode"];
    EXPECT_EQ(pair["baseline_episode"], episode);
    EXPECT_EQ(pair["seed"], EpisodeSeed(7, episode));
    EXPECT_EQ(pair["failure_reason"], "timeout");
    EXPECT_EQ(pair["succeeded"], episode < 31 ? "baseline" : "run") << episode;
    EXPECT_TRUE(episode >= 28 && episode < 46) << episode;
    of_run += pair["succeeded"] == "run";
  }
  EXPECT_EQ(of_run, 15);
  EXPECT_EQ(json["comparisons"][0]["tasks"][0]["metrics"]["slip_count"]["p"].dump(), "null");
}

// The run needs half, twice and three times the baseline's time. A pair with one success does not count. The
// logarithms of the ratios are -ln 2, ln 2 and ln 3; Student's t with 2 degrees of freedom is 4.302653.
TEST_F(CompareTest, RatiosOfEffortAreThoseOfThePairs) {
  const auto runs = [this](const std::string& name, const std::vector<double>& times, bool last_succeeds) {
    std::vector<ordered_json> lines;
    for (int i = 0; i < 4; ++i) {
      lines.push_back(EpisodeLine(i, i < 3 || last_succeeds, {{"completion_time", times[i]}}));
      lines.back()["seed"] = EpisodeSeed(7, i);
    }
    WriteRun(folder_.path() / name, Info(4), lines);
    return ReadRuns(folder_.path() / name);
  };
  const RecordedRuns baseline = runs("a", {4, 4, 1, 9}, true), run = runs("b", {2, 8, 3, 1}, false);
  const Comparison result = CompareRuns(run, baseline);
  const MetricComparison& time = result.tasks[0].metrics[0];
  EXPECT_EQ(time.number.name, "completion_time");
  EXPECT_EQ(time.count, 3);
  EXPECT_NEAR(*time.ratio, std::cbrt(3), 1e-12);
  const double two = std::log(2), three = std::log(3), mean = three / 3;
  const double error =
      std::sqrt((std::pow(-two - mean, 2) + std::pow(two - mean, 2) + std::pow(three - mean, 2)) / 2 / 3);
  EXPECT_NEAR(time.ratio_95.lower, std::exp(mean - 4.302653 * error), 1e-6);
  EXPECT_NEAR(time.ratio_95.upper, std::exp(mean + 4.302653 * error), 1e-4);
  EXPECT_NEAR(*CompareRuns(baseline, run).tasks[0].metrics[0].ratio, 1 / std::cbrt(3), 1e-12);
  const std::string text = ComparisonText(result, true);
  EXPECT_NE(text.find("ratios of the 3 pairs in which both succeeded"), std::string::npos) << text;
  EXPECT_EQ(ComparisonJson({result})["comparisons"][0]["tasks"][0]["metrics"]["completion_time"]["ratio_of"],
            "pairs");
}

// Newcombe's interval is approximate, and the exact test needs six pairs to reject.
TEST_F(CompareTest, HeadlineStatesPIfTheIntervalExcludes0) {
  Comparison result = CompareRuns(Run("b", Info(5), First(0, 5), 6), Run("a", Info(5), First(5, 5), 5));
  EXPECT_THAT(
      Headline(result),
      testing::MatchesRegex("No difference shown between b and a: -100 points, 95 % CI -100 to -.*, but "
                            "p = 0.063"));
  // A bound close to 0 is not shown as 0.
  result.success.difference_95 = {.lower = -0.81, .upper = -0.003};
  EXPECT_THAT(Headline(result), testing::HasSubstr("95 % CI -81.0 to -0.3, but p = 0.063"));
  EXPECT_THAT(ComparisonText(result, false), testing::HasSubstr("   -81.0 to     -0.3   0.063"));
}

// The difference is 22 um of a distance in meters, whose means have three decimals.
TEST_F(CompareTest, ShownDifferenceIsNotRoundedTo0) {
  MetricComparison metric =
      CompareRuns(Run("b", Info(5), First(5, 5), 6), Run("a", Info(5), First(5, 5), 5)).tasks[0].metrics[0];
  ASSERT_EQ(metric.number.scale(), 1);
  metric.mean = 0.1;
  metric.difference = -2.2e-5;
  metric.difference_95 = {.lower = -3e-5, .upper = -1e-5};
  metric.p = metric.p_holm = 0.008;
  EXPECT_EQ(metric.decimals(), 6);
  metric.difference = 6e-4;
  EXPECT_EQ(metric.decimals(), 3);
  metric.difference = 1e-9;
  EXPECT_EQ(metric.decimals(), 6);
  metric.p_holm = 0.05;
  EXPECT_EQ(metric.decimals(), 3);
}

TEST_F(CompareTest, StatesThatNothingCanBeConcluded) {
  const RecordedRuns a = Run("a", Info(10), First(7, 10), 5);
  EXPECT_EQ(Conclusion(CompareRuns(Run("b", Info(10), First(10, 10), 5), a)),
            "No difference shown between b and a: 30 points, 95 % CI -4 to 60. 10 of 10 against 7 of 10 on "
            "the same "
            "seeds, exact McNemar p = 0.250. 10 pairs like these detect a true difference of 68 "
            "points with 80 % power; detecting one of 30 points requires about 25 pairs.");
  const std::string few =
      Conclusion(CompareRuns(Run("c", Info(4), First(4, 4), 5), Run("d", Info(4), First(0, 4), 5)));
  EXPECT_TRUE(few.ends_with("4 pairs like these are too few to detect any difference.")) << few;
}

TEST_F(CompareTest, UnpairedIsStated) {
  const Comparison result =
      CompareRuns(Run("b", Info(50, 8), First(43, 50), 5), Run("a", Info(50), First(31, 50), 5));
  EXPECT_FALSE(result.success.paired);
  EXPECT_NEAR(result.success.p, 0.01129645681947858, 1e-10);  // scipy's fisher_exact
  EXPECT_EQ(result.success.difference_95.lower, metrics::NewcombeInterval(43, 50, 31, 50).lower);
  EXPECT_TRUE(Conclusion(result).ends_with("Fisher's exact test p = 0.011.")) << Conclusion(result);
  EXPECT_EQ(result.remarks[0], "lift_pot/position: no seed in common: compared as independent samples");
  EXPECT_EQ(result.tasks[0].metrics[0].count, 43);
  EXPECT_EQ(result.tasks[0].metrics[0].baseline_count, 31);
  const MetricComparison& metric = result.tasks[0].metrics[0];
  EXPECT_EQ(*metric.ratio, metric.mean / metric.baseline_mean);
  EXPECT_TRUE(std::isnan(metric.ratio_95.lower));
}

// Student's t interval of these five differences excludes 0, but the smallest p of five signed ranks is 1/16.
TEST_F(CompareTest, DisagreementOfTestAndIntervalIsStated) {
  const auto runs = [this](const std::string& name, const std::vector<double>& times) {
    std::vector<ordered_json> lines;
    for (int i = 0; i < 5; ++i) {
      lines.push_back(EpisodeLine(i, true, {{"completion_time", times[i]}}));
      lines.back()["seed"] = EpisodeSeed(7, i);
    }
    WriteRun(folder_.path() / name, Info(5), lines);
    return ReadRuns(folder_.path() / name);
  };
  const RecordedRuns baseline = runs("a", {4, 4, 4, 4, 4});
  const std::string remark =
      "lift_pot/position: the interval of the mean difference excludes 0, but so few pairs differ that "
      "the test cannot reach p < 0.05: completion time";
  EXPECT_THAT(CompareRuns(runs("b", {5, 5.1, 5.2, 5.3, 5.4}), baseline).remarks, Contains(remark));
  EXPECT_THAT(CompareRuns(runs("c", {5, 3.1, 5.2, 3.3, 5.4}), baseline).remarks, Not(Contains(remark)));
}

// Nineteen pairs fall by about 1, and one rises by 50: the ranks differ, the mean does not.
TEST_F(CompareTest, ADifferenceOfRanksWithoutOneOfMeansIsStated) {
  const auto run = [this](const std::string& name, double step, double last) {
    std::vector<ordered_json> lines;
    for (int i = 0; i < 20; ++i) {
      lines.push_back(
          EpisodeLine(i, true, {{"completion_time", i == 19 ? last : 100 - step * (1 + 0.01 * i)}}));
      lines.back()["seed"] = EpisodeSeed(7, i);
    }
    WriteRun(folder_.path() / name, Info(20), lines);
    return ReadRuns(folder_.path() / name);
  };
  const Comparison result = CompareRuns(run("b", 1, 150), run("a", 0, 100));
  EXPECT_LT(result.tasks[0].metrics[0].p_holm, 0.05);
  EXPECT_THAT(result.remarks,
              Contains("lift_pot/position: the test, which compares ranks, shows a difference, "
                       "but the interval of the mean difference contains 0: completion time"));
}

TEST_F(CompareTest, RemarksThatAllPairsAreEqual) {
  const RecordedRuns a = Run("a", Info(3), First(1, 3), 1);
  const auto remark = testing::EndsWith("equal on both sides, as if one policy had run twice");
  EXPECT_THAT(CompareRuns(Run("copy", Info(3), First(1, 3), 1), a).remarks, Contains(remark));
  EXPECT_THAT(CompareRuns(Run("slower", Info(3), First(1, 3), 1.5), a).remarks, Not(Contains(remark)));
  EXPECT_THAT(CompareRuns(Run("better", Info(3), First(2, 3), 1), a).remarks, Not(Contains(remark)));
}

// A ratio of values of both signs would have no meaning.
TEST_F(CompareTest, NoRatioOfValuesOfBothSigns) {
  for (const int64_t seed : {0, 8}) {
    const auto runs = [&](const std::string& name, double first, int64_t run_seed) {
      std::vector<ordered_json> lines;
      for (int i = 0; i < 4; ++i) {
        lines.push_back(EpisodeLine(
            i, true, {{"target_distance", {{"lift distance", i == 0 ? first : 0.1 + 0.01 * i}}}}));
        lines.back()["seed"] = EpisodeSeed(run_seed, i);
      }
      WriteRun(folder_.path() / name, Info(4, run_seed), lines);
      return ReadRuns(folder_.path() / name);
    };
    const RecordedRuns baseline = runs("a", 0.02, 0);
    const auto ratio = [&](double first) {
      const Comparison result = CompareRuns(runs("b", first, seed), baseline);
      const std::vector<MetricComparison>& metrics = result.tasks[0].metrics;
      return std::ranges::find(metrics, "target_distance.lift distance",
                               [](const MetricComparison& metric) { return metric.number.name; })
          ->ratio;
    };
    EXPECT_TRUE(ratio(0.01)) << seed;
    EXPECT_FALSE(ratio(-0.01)) << seed;
  }
}

TEST_F(CompareTest, NothingHasASign) {
  // Newcombe's lower bound is -0.2 points.
  const std::string text =
      Conclusion(CompareRuns(Run("b", Info(10, 8), First(10, 10), 5), Run("a", Info(40), First(28, 40), 5)));
  EXPECT_THAT(text, testing::HasSubstr("a: 30 points, 95 % CI 0 to 45."));
}

// Whole points would contradict 100 % and 38 %.
TEST_F(CompareTest, TheDifferenceAgreesWithTheRates) {
  const Comparison result = CompareRuns(Run("b", Info(8), First(3, 8), 5), Run("a", Info(8), First(8, 8), 5));
  EXPECT_EQ(DifferenceInPoints(result.success), "-62.5");
  EXPECT_THAT(Conclusion(result), testing::HasSubstr("between b and a: -62.5 points, "));
}

TEST_F(CompareTest, LeavesOutWhatHasNoPartner) {
  RecordedRuns a = Run("a", Info(12), First(12, 12), 5);
  a.runs[0].episodes[2].complete = false;
  const Comparison result = CompareRuns(Run("b", Info(10), First(9, 10), 5), a);
  EXPECT_EQ(result.success.trials, 9);
  EXPECT_EQ(result.tasks[0].unmatched, 1);
  EXPECT_EQ(result.tasks[0].baseline_unmatched, 2);
  EXPECT_EQ(result.remarks[0],
            "lift_pot/position: excluded because the other run lacks them: 1 episode of b and 2 of a");
  a.runs[0].episodes[2].end_reason = "server_error";
  EXPECT_THAT(CompareRuns(Run("b", Info(10), First(9, 10), 5), a).remarks,
              testing::Contains(
                  "a: invalid and excluded from all rates because the policy's server failed: episode 2; "
                  "--resume runs it again"));
}

TEST_F(CompareTest, RemarksThatEpisodesContinuedAfterSuccess) {
  ordered_json info = Info(2), other = Info(2);
  info["after_success_s"] = 1.0;
  other["after_success_s"] = 0.0;
  EXPECT_THAT(
      CompareRuns(Run("b", info, First(2, 2), 5), Run("a", other, First(2, 2), 5)).remarks,
      testing::Contains(
          "b and a were made with after_success_s 1.0 against 0.0, which alone may cause differences"));
}

// Six pairs have a verdict on both sides: 6 of 6 against 5 of 6.
TEST_F(CompareTest, PairsWithoutAVerdictAreInNoRate) {
  const RecordedRuns baseline = Run("a", Info(30), First(6, 30), 5);
  RecordedRuns judged = Run("b", Info(30), First(5, 30), 6);
  for (size_t i = 6; i < 30; ++i) judged.runs[0].episodes[i].failure_reason = end_reason::kNotJudged;
  for (const bool is_swapped : {false, true}) {
    const Comparison result = is_swapped ? CompareRuns(baseline, judged) : CompareRuns(judged, baseline);
    const SuccessComparison& success = result.success;
    EXPECT_EQ(success.trials, 6);
    EXPECT_EQ(success.baseline_trials, 6);
    EXPECT_NEAR(success.difference, is_swapped ? 1.0 / 6 : -1.0 / 6, 1e-12);
    EXPECT_THAT(result.remarks, Contains("lift_pot/position: excluded from the success rates because an "
                                         "episode has no verdict: 24 pairs"));
    EXPECT_THAT(WhatIsCounted(result.tasks[0]), testing::StartsWith("Means over the 30 pairs"));
  }
}

TEST_F(CompareTest, RefusesWhatCannotBeCompared) {
  const RecordedRuns a = Run("a", Info(2), First(2, 2), 5);
  EXPECT_EQ(Refusal(Run("b", Info(2, 7, 100), First(2, 2), 5), a),
            "b ran at 100 Hz and a at 50 Hz: values depend on the control rate, so these runs cannot be "
            "compared");
  ordered_json info = Info(2);
  info["physics_sha256"] = "other";
  EXPECT_EQ(Refusal(Run("c", info, First(2, 2), 5), a),
            "c and a were made with different physics models (scene, robot or physics step), so these runs "
            "cannot be "
            "compared");
  info = Info(2);
  info["task_sha256"] = "other";
  EXPECT_EQ(Refusal(Run("d", info, First(2, 2), 5), a),
            "d and a were made with different descriptions of the task, so these runs cannot be compared");
  info.erase("task_sha256");
  EXPECT_NE(Refusal(Run("e", info, First(2, 2), 5), a).find("no \"task_sha256\""), std::string::npos);
  RecordedRuns other = a;
  other.runs[0].task = "stack_two_blocks";
  EXPECT_NE(Refusal(other, a).find("no task in common"), std::string::npos);
}

// Runs whose episodes are equal in every number except the given ones.
class EqualEpisodesTest : public CompareTest {
 protected:
  struct Each {
    bool success;
    double time, yaw_rad = 0;
  };
  // with_starts: whether the lines contain the randomized initial states.
  RecordedRuns Equal(const std::string& name, const std::vector<Each>& episodes, bool with_starts = false) {
    std::vector<ordered_json> lines;
    for (size_t i = 0; i < episodes.size(); ++i) {
      lines.push_back(
          EpisodeLine(static_cast<int>(i), episodes[i].success, {{"completion_time", episodes[i].time}}));
      if (with_starts) lines.back()["parameters"] = {{"cube_yaw_rad", episodes[i].yaw_rad}};
    }
    WriteRun(folder_.path() / name, Info(static_cast<int>(episodes.size())), lines);
    return ReadRuns(folder_.path() / name);
  }
};

// Nothing was randomized, and both policies always behave the same. Twenty pairs count as one sample in the
// test, but the rates include all twenty.
TEST_F(EqualEpisodesTest, EqualPairsAreOneSample) {
  const RecordedRuns good = Equal("good", std::vector<Each>(20, {true, 5}));
  const RecordedRuns bad = Equal("bad", std::vector<Each>(20, {false, 20}));
  const Comparison result = CompareRuns(good, bad);
  EXPECT_EQ(result.success.trials, 20);
  EXPECT_EQ(result.success.successes, 20);
  EXPECT_EQ(result.success.difference, 1);
  EXPECT_EQ(result.success.samples.pairs.only_a, 1);
  EXPECT_EQ(result.success.p, 1);
  EXPECT_EQ(result.success.difference_95.lower,
            metrics::NewcombePairedInterval({.both = 0, .only_a = 1, .only_b = 0, .neither = 0}).lower);
  EXPECT_THAT(result.remarks, testing::Contains("lift_pot/position: all 20 pairs have equal starts and equal "
                                                "numbers: interval and test count them as one"));
  EXPECT_TRUE(Conclusion(result).ends_with(" 1 pair like this is too few to detect any difference."))
      << Conclusion(result);
  // If a single pair differs, every pair counts.
  std::vector<Each> some(20, {false, 20});
  some[3] = {true, 4};
  EXPECT_EQ(CompareRuns(good, Equal("some", some)).success.samples.pairs.only_a, 19);
  // In independent samples, this rule applies to each run separately.
  RecordedRuns other = bad;
  for (RecordedEpisode& episode : other.runs[0].episodes) episode.seed += 1;
  const Comparison independent = CompareRuns(good, other);
  EXPECT_EQ(independent.success.trials, 20);
  EXPECT_EQ(independent.success.samples.trials, 1);
  EXPECT_EQ(independent.success.samples.baseline_trials, 1);
  EXPECT_EQ(independent.success.p, 1);
  EXPECT_EQ(independent.success.difference_95.upper, metrics::NewcombeInterval(1, 1, 0, 1).upper);
}

// No number depends on the initial state, but each initial state differs, so all episodes count.
TEST_F(EqualEpisodesTest, EqualNumbersFromDifferentStartsAreAllSamples) {
  std::vector<Each> half, none;
  for (int i = 0; i < 30; ++i) {
    half.push_back({i < 15, i < 15 ? 5.0 : 20.0, 0.01 * i});
    none.push_back({false, 20, 0.01 * i});
  }
  const Comparison result = CompareRuns(Equal("half", half, true), Equal("none", none, true));
  EXPECT_EQ(result.success.successes, 15);
  EXPECT_EQ(result.success.trials, 30);
  EXPECT_EQ(result.success.samples.trials, 30);
  EXPECT_EQ(result.success.difference, 0.5);
  EXPECT_NEAR(result.success.p, 2 * std::pow(0.5, 15), 1e-12);
  EXPECT_THAT(Conclusion(result),
              testing::MatchesRegex("half is 50 points better than none, 95 % CI .*\\. 15 of "
                                    "30 against 0 of 30 on the same seeds, .*"));
  // All pairs also count as samples if the episodes of both runs are equal except for the initial states.
  EXPECT_EQ(CompareRuns(Equal("never", none, true), Equal("none", none, true)).success.samples.trials, 30);
  // All pairs also count as samples if the initial states are equal but the policy is not deterministic.
  for (Each& each : half) each.yaw_rad = 0;
  for (Each& each : none) each.yaw_rad = 0;
  EXPECT_EQ(CompareRuns(Equal("half", half, true), Equal("none", none, true)).success.samples.trials, 30);
}

TEST_F(EqualEpisodesTest, EqualRemarksOnSeveralTasksShareALine) {
  const auto suite = [](const std::string& name, RecordedRuns runs) {
    runs.name = name;
    runs.runs.push_back(runs.runs[0]);
    runs.runs[1].task = "lift_tray";
    return runs;
  };
  const Comparison result = CompareRuns(suite("good", Equal("good", std::vector<Each>(20, {true, 5}))),
                                        suite("bad", Equal("bad", std::vector<Each>(20, {false, 20}))));
  EXPECT_EQ(std::ranges::count_if(
                result.remarks, [](const std::string& r) { return r.find("20 pairs") != std::string::npos; }),
            1);
  EXPECT_THAT(
      result.remarks,
      testing::Contains("lift_pot/position, lift_tray/position: all 20 pairs have equal starts and equal "
                        "numbers: interval and test count them as one"));
}

// In a suite, a task whose pairs are all equal counts as one sample in the test, but fully in the rates.
TEST_F(EqualEpisodesTest, InASuiteTheyCountOnceAndNeverTurnTheTestAround) {
  const auto suite = [&](const std::string& name, const RecordedRuns& base, const RecordedRuns& position) {
    RecordedRuns runs{.folder = name, .name = name, .is_suite = true, .runs = {}, .missing = {}};
    runs.runs = {base.runs[0], position.runs[0]};
    runs.runs[0].variation = "base";
    return runs;
  };
  const RecordedRuns good = Equal("good", std::vector<Each>(40, {true, 5}));
  const RecordedRuns bad = Equal("bad", std::vector<Each>(40, {false, 20}));
  const Comparison result = CompareRuns(suite("b", good, Run("b1", Info(10), First(1, 10), 5)),
                                        suite("a", bad, Run("a1", Info(10), First(10, 10), 5)));
  EXPECT_EQ(result.success.successes, 41);
  EXPECT_EQ(result.success.samples.pairs.only_a, 1);
  EXPECT_EQ(result.success.samples.pairs.only_b, 9);
  EXPECT_GT(result.success.difference, 0);
  EXPECT_FALSE(OutlookOf(result.success).needed) << "the samples favor the other policy";
  // The samples alone, 1 to 9, would give p = 0.02 in favor of the other policy.
  EXPECT_EQ(result.success.p, 1);
  EXPECT_EQ(result.success.judgment(), Judgment::kNone);
}

TEST_F(CompareTest, TwoVariationsAreNamedFirst) {
  RecordedRuns b = Run("b", Info(6), First(6, 6), 5);
  b.runs[0].variation = "base";
  const Comparison result = CompareRuns(b, Run("a", Info(6), First(0, 6), 5));
  EXPECT_TRUE(Headline(result).starts_with("b is 100 points better than a")) << Headline(result);
  EXPECT_TRUE(
      Evidence(result).starts_with("These are two variations: b ran lift_pot/base and a ran "
                                   "lift_pot/position, so a difference may come from the variation. 6 of 6 "))
      << Evidence(result);
  const std::string text = ComparisonText(result, false);
  EXPECT_TRUE(text.starts_with("b (expert) against a (expert), lift_pot/base against lift_pot/position\n"))
      << text;
  EXPECT_THAT(text, testing::HasSubstr("          a          b  difference"));
}

// Columns show up to 16 characters of a name. The policy is added only if it differs from the name.
TEST_F(CompareTest, TextHasTheNames) {
  const std::string text = ComparisonText(
      CompareRuns(Run("pi0-ckpt-12000", Info(6), First(6, 6), 5), Run("expert", Info(6), First(0, 6), 5)),
      false);
  EXPECT_TRUE(text.starts_with("pi0-ckpt-12000 (expert) against expert, lift_pot/position\n")) << text;
  EXPECT_THAT(text, testing::HasSubstr("          expert  pi0-ckpt-12000  difference"));
  const std::string long_names =
      ComparisonText(CompareRuns(Run("diffusion-lift_pot-030000", Info(6), First(6, 6), 5),
                                 Run("a", Info(6), First(0, 6), 5)),
                     false);
  EXPECT_THAT(long_names, testing::HasSubstr("               a  ..ift_pot-030000  difference"));
}

TEST_F(CompareTest, TextFitsTheTerminal) {
  const Comparison result = CompareRuns(Run("run_noisyexpert", Info(20), First(8, 20), 6),
                                        Run("run_expert", Info(20), First(20, 20), 5));
  const std::string whole = ComparisonText(result, true);
  EXPECT_EQ(ComparisonText(result, true, false, 1000), whole);
  for (const int width : {62, 70, 80, 100, 110}) {
    const std::string text = ComparisonText(result, true, false, width);
    EXPECT_LE(LongestLine(text), width) << text;
    EXPECT_THAT(text, testing::HasSubstr("  worse\n"));
    EXPECT_EQ(text.find("not shown at ") != std::string::npos, width < 110) << text;
  }
  // Names are shortened and columns omitted, but the verdict and the p from which it follows are shown.
  const std::string text = ComparisonText(result, true, false, 80);
  EXPECT_THAT(text, testing::HasSubstr("  .._expert  ..yexpert  difference    Holm\nsuccess "));
  EXPECT_THAT(text, testing::HasSubstr(
                        "\nnot shown at 80 columns: 95 % CI of difference, p (see --json or --report)\n"));
}

TEST_F(CompareTest, RemarksOnDifferencesOfContracts) {
  ordered_json info = Info(3);
  info["policy_contract"] = {
      {"name", "a"}, {"rate_hz", 20}, {"action", {{"kind", "joint_delta"}, {"arms", {1, 2}}}}};
  const RecordedRuns a = Run("a", info, First(1, 3), 1);
  info["policy_contract"]["name"] = "b";
  const RecordedRuns same = Run("b", info, First(1, 3), 1);
  EXPECT_EQ(MadeDifferently(same.runs[0], a.runs[0]), "");
  info["policy_contract"]["action"] = {{"kind", "joint_position"}, {"arms", {1}}, {"first_step_rad", 0.5}};
  const RecordedRuns other = Run("c", info, First(1, 3), 1);
  EXPECT_EQ(
      MadeDifferently(other.runs[0], a.runs[0]),
      "contract: action.kind \"joint_position\" against \"joint_delta\", contract: action.first_step_rad 0.5 "
      "against none, contract: action.arms.1 none against 2");
  // A run without a renderer rendered nothing, so its `gl` changes nothing.
  ordered_json drew = info;
  drew["gl"] = "osmesa";
  drew["renderer"] = "osmesa (llvmpipe)";
  ordered_json drew_nothing = info;
  drew_nothing["gl"] = "software";
  EXPECT_EQ(
      MadeDifferently(Run("e", drew, First(1, 3), 1).runs[0], Run("f", drew_nothing, First(1, 3), 1).runs[0]),
      "");
  drew_nothing["renderer"] = "osmesa (llvmpipe)";
  EXPECT_EQ(
      MadeDifferently(Run("e", drew, First(1, 3), 1).runs[0], Run("f", drew_nothing, First(1, 3), 1).runs[0]),
      "gl \"osmesa\" against \"software\"");
  // Force limits are compared by their hash if both runs have it.
  ordered_json limited = Info(3), elsewhere = Info(3);
  limited["limits"] = "/a/limits.yaml";
  elsewhere["limits"] = "/b/limits.yaml";
  const auto limit_differences = [&] {
    return MadeDifferently(Run("g", limited, First(1, 3), 1).runs[0],
                           Run("h", elsewhere, First(1, 3), 1).runs[0]);
  };
  EXPECT_EQ(limit_differences(), "limits \"/a/limits.yaml\" against \"/b/limits.yaml\"");
  limited["limits_sha256"] = elsewhere["limits_sha256"] = "12";
  EXPECT_EQ(limit_differences(), "");
  elsewhere["limits_sha256"] = nullptr;
  EXPECT_EQ(limit_differences(), "limits_sha256 \"12\" against null");
  info["policy_contract"] = nullptr;
  const RecordedRuns scripted = Run("d", info, First(1, 3), 1);
  EXPECT_EQ(MadeDifferently(scripted.runs[0], a.runs[0]), "");
}

TEST_F(CompareTest, RemarksOnThePolicysTimeoutOnlyIfItWasExceeded) {
  ordered_json derived = Info(3), usual = Info(3);
  derived["policy_timeout_s"] = 730;
  usual["policy_timeout_s"] = 60;
  const RecordedRuns served = Run("served", derived, First(1, 3), 1),
                     expert = Run("e", usual, First(3, 3), 1);
  EXPECT_EQ(MadeDifferently(served.runs[0], expert.runs[0]), "");
  RecordedRun exceeded = expert.runs[0];
  exceeded.episodes[1].end_reason = end_reason::kPolicyTimeout;
  EXPECT_EQ(MadeDifferently(served.runs[0], exceeded), "policy_timeout_s 730 against 60");
  EXPECT_EQ(MadeDifferently(exceeded, served.runs[0]), "policy_timeout_s 60 against 730");
}

TEST_F(CompareTest, RemarksOnOtherDifferences) {
  ordered_json live = Info(6), lockstep = Info(6);
  live["realtime"] = true;
  lockstep["realtime"] = false;
  live["evalbus_version"] = lockstep["evalbus_version"] = "0.1.0";
  live["mujoco_version"] = "3.1.0";
  lockstep["mujoco_version"] = "2.2.2";
  // The policy, the folder and the number of workers do not affect comparability.
  live["policy"] = "mine";
  live["workers"] = 4;
  lockstep["workers"] = 1;
  const RecordedRuns a = Run("a", lockstep, First(6, 6), 5);
  const Comparison result = CompareRuns(Run("b", live, First(6, 6), 5), a);
  EXPECT_THAT(
      result.remarks,
      testing::ElementsAre("b and a were made with realtime true against false, mujoco_version \"3.1.0\" "
                           "against \"2.2.2\", which alone may cause differences"));
  EXPECT_THAT(CompareRuns(Run("c", lockstep, First(5, 6), 5), a).remarks, testing::IsEmpty());
  // The log's format and videos do not affect comparability either, because the scores are the same.
  ordered_json packed = lockstep;
  packed["log"] = "zstd";
  packed["video"] = {"front"};
  packed["workers"] = 2;
  EXPECT_THAT(CompareRuns(Run("d", packed, First(5, 6), 5), a).remarks, testing::IsEmpty());
}

TEST_F(CompareTest, RefusesToMixEngines) {
  ordered_json info = Info(2);
  const RecordedRuns unnamed = Run("unnamed", info, First(1, 2), 5);
  info["mujoco_version"] = "2.2.2";
  const RecordedRuns a = Run("a", info, First(1, 2), 5), b = Run("b", info, First(2, 2), 5);
  info["mujoco_version"] = "3.3.3";
  const RecordedRuns other = Run("other", info, First(1, 2), 5);
  // Nothing is simulated in a scored run, so it fits any version.
  info["source"] = "file";
  const RecordedRuns scored = Run("scored", info, First(1, 2), 5);
  EXPECT_NO_THROW(CheckSameEngine({&a, &unnamed, &b, &scored}));
  try {
    CheckSameEngine({&a, &b, &other});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              a.folder.string() + " was simulated by MuJoCo 2.2.2 and " + other.folder.string() +
                  " by MuJoCo 3.3.3: success rates change with the version; 'evalbus compare "
                  "--across-engines' compares them anyway");
  }
}

// Tests which policy is called better, and when none is.
class MeritTest : public CompareTest {
 protected:
  struct Each {
    bool success;
    // Highest stage reached, of two; 0 if none was reached.
    int stage;
    double slips, time = 20, jerk = 1;
  };
  RecordedRuns With(const std::string& name, const std::vector<Each>& episodes, ordered_json info) {
    std::vector<ordered_json> lines;
    for (size_t i = 0; i < episodes.size(); ++i) {
      const Each& each = episodes[i];
      lines.push_back(EpisodeLine(static_cast<int>(i), each.success,
                                  {{"completion_time", each.time},
                                   {"subtask_progress", each.stage / 2.0},
                                   {"slip_count", each.slips},
                                   {"overall_rms_joint_jerk", each.jerk}}));
      lines.back()["seed"] = EpisodeSeed(info["seed"], static_cast<int>(i));
    }
    info["episodes"] = episodes.size();
    WriteRun(folder_.path() / name, info, lines);
    return ReadRuns(folder_.path() / name);
  }
  RecordedRuns With(const std::string& name, const std::vector<Each>& episodes) {
    return With(name, episodes, Info(1));
  }
  static Judgment Of(const Comparison& comparison, const std::string& metric) {
    for (const MetricComparison& compared : comparison.tasks[0].metrics) {
      if (compared.number.name == metric) return compared.judgment();
    }
    ADD_FAILURE() << metric;
    return Judgment::kNone;
  }
  static std::string WordOf(const Comparison& comparison, const std::string& metric) {
    for (const MetricComparison& compared : comparison.tasks[0].metrics) {
      if (compared.number.name == metric) return compared.word();
    }
    return "no such metric";
  }
};

// A policy that never grasps cannot slip.
TEST_F(MeritTest, LessProgressIsNotBetterInWhatCanGoWrong) {
  std::vector<Each> tries, stays, careful, worse;
  for (int i = 0; i < 30; ++i) {
    tries.push_back({i < 23, 2, 1.0 + i % 3});
    stays.push_back({false, 0, 0, 20, 1 + 0.1 * i});
    careful.push_back({i < 23, 2, 0});
    worse.push_back({i < 10, 2, 5.0 + i % 3});
  }
  const RecordedRuns baseline = With("tries", tries);
  const Comparison result = CompareRuns(With("stays", stays), baseline);
  EXPECT_EQ(Of(result, "slip_count"), Judgment::kDiffers);
  EXPECT_EQ(WordOf(result, "slip_count"), "lower (reached no stage)");
  EXPECT_THAT(
      result.remarks,
      testing::ElementsAre("lift_pot/position: stays succeeded in no episode and reached no stage: not "
                           "called better in slips"));
  // In the reverse comparison, the baseline is not called worse.
  const Comparison reversed = CompareRuns(baseline, With("stays", stays));
  EXPECT_EQ(Of(reversed, "slip_count"), Judgment::kDiffers);
  EXPECT_EQ(WordOf(reversed, "slip_count"), "higher (baseline reached no stage)");
  EXPECT_EQ(Of(CompareRuns(With("careful", careful), baseline), "slip_count"), Judgment::kBetter);
  // This policy has fewer successes.
  careful[0].success = false;
  const Comparison less = CompareRuns(With("careful", careful), baseline);
  EXPECT_EQ(Of(less, "slip_count"), Judgment::kDiffers);
  EXPECT_EQ(WordOf(less, "slip_count"), "lower (made less progress)");
  EXPECT_THAT(less.remarks,
              testing::ElementsAre(
                  "lift_pot/position: careful made less progress, which alone can improve a metric: not "
                  "called better in slips"));
  // This policy has as many successes but reaches fewer stages.
  careful[0].success = true;
  careful[29].stage = 1;
  EXPECT_EQ(Of(CompareRuns(With("careful", careful), baseline), "slip_count"), Judgment::kDiffers);
  // A policy that makes less progress and slips more is still worse.
  EXPECT_EQ(Of(CompareRuns(With("worse", worse), baseline), "slip_count"), Judgment::kWorse);
}

// Policy a fails from hard initial states, and b never fails. From the same initial state both take the same
// time.
TEST_F(MeritTest, OfIndependentSamplesEffortOfSurvivorsIsNoMerit) {
  std::vector<Each> fails, never, quick;
  for (int i = 0; i < 100; ++i) {
    const double difficulty = (i * 37 % 100) / 100.0;
    fails.push_back(
        {difficulty <= 0.5, difficulty <= 0.5 ? 2 : 0, 0, difficulty <= 0.5 ? 4 + 6 * difficulty : 20});
    never.push_back({true, 2, 0, 4 + 6 * difficulty});
    quick.push_back({true, 2, 0, 3 + 6 * difficulty});
  }
  const RecordedRuns b = With("b", never, Info(1, 8));
  const Comparison result = CompareRuns(With("a", fails), b);
  EXPECT_FALSE(result.success.paired);
  EXPECT_EQ(Of(result, "completion_time"), Judgment::kDiffers);
  EXPECT_THAT(
      result.remarks,
      testing::Contains("lift_pot/position: a is compared over its own successes only, which may have been "
                        "the easier starts: not called better in completion time"));
  // Without failures, no initial state is excluded.
  EXPECT_EQ(Of(CompareRuns(With("quick", quick), b), "completion_time"), Judgment::kBetter);
  // In paired runs, only the pairs in which both policies succeeded are compared.
  EXPECT_EQ(Of(CompareRuns(With("quick", quick), With("a", fails)), "completion_time"), Judgment::kBetter);
}

// Time stamps and encoders of a recording increase the jerk.
TEST_F(MeritTest, ARecordingIsNeitherBetterNorWorseThanASimulationInJerk) {
  std::vector<Each> smooth, rough;
  for (int i = 0; i < 20; ++i) {
    smooth.push_back({true, 2, 0, 5 + 0.1 * i, 1 + 0.01 * i});
    rough.push_back({true, 2, 0, 6 + 0.1 * i, 9 + 0.01 * i});
  }
  ordered_json watched = Info(1), from_file = Info(1);
  watched["watch"] = true;
  from_file["source"] = "file";
  const RecordedRuns simulated = With("sim", smooth);
  for (const ordered_json& info : {watched, from_file}) {
    const Comparison result = CompareRuns(With("robot", rough, info), simulated);
    EXPECT_EQ(Of(result, "overall_rms_joint_jerk"), Judgment::kDiffers);
    EXPECT_EQ(Of(result, "completion_time"), Judgment::kWorse);
    EXPECT_THAT(
        result.remarks,
        testing::Contains("lift_pot/position: evalbus did not randomize the starts of robot: episodes with "
                          "equal numbers count as pairs, whether or not their starts are equal"));
    EXPECT_THAT(result.remarks,
                testing::Contains("lift_pot/position: sim is compared with a recording, whose noise this "
                                  "metric amplifies: not called better in joint jerk, rms"));
  }
  EXPECT_EQ(Of(CompareRuns(With("robot", rough, watched), With("other", smooth, watched)),
               "overall_rms_joint_jerk"),
            Judgment::kWorse);
  EXPECT_EQ(Of(CompareRuns(With("rough", rough), simulated), "overall_rms_joint_jerk"), Judgment::kWorse);
}

TEST_F(CompareTest, TimesThatDifferByRoundingAreEqual) {
  // 4.66 5.06 5.20 5.80 5.88 against 4.60 5.20 5.46 5.66 5.74: p = 1 (statistics_test.cc works it out).
  const auto run = [&](const std::string& name, const std::vector<double>& times) {
    std::vector<ordered_json> lines;
    for (size_t i = 0; i < times.size(); ++i) {
      lines.push_back(EpisodeLine(static_cast<int>(i), true, {{"completion_time", times[i]}}));
    }
    WriteRun(folder_.path() / name, Info(static_cast<int>(times.size())), lines);
    return ReadRuns(folder_.path() / name);
  };
  const Comparison result =
      CompareRuns(run("b", {4.66, 5.06, 5.20, 5.80, 5.88}), run("a", {4.60, 5.20, 5.46, 5.66, 5.74}));
  EXPECT_EQ(result.tasks[0].metrics[0].p, 1);
  EXPECT_FALSE(CompareRuns(run("c", {0.1 + 0.2, 1}), run("d", {0.3, 1})).tasks[0].metrics[0].p);
}

// Each row has a p and an adjusted p; a line below states that intervals are not adjusted.
TEST_F(CompareTest, TheTableStatesWhatIsAdjusted) {
  const Comparison result = CompareRuns(Run("b", Info(8), First(8, 8), 6), Run("a", Info(8), First(7, 8), 5));
  const std::string text = ComparisonText(result, false);
  EXPECT_THAT(text, testing::ContainsRegex("success .* 1.000   1.000\n"));
  EXPECT_THAT(text,
              testing::HasSubstr("Means over the 8 pairs with equal seeds; *: over the 7 pairs in which "
                                 "both succeeded. p: Wilcoxon's signed-rank test.\n"
                                 "Holm: p of metrics adjusted for 1 metric. Intervals are not adjusted: each "
                                 "covers 95 % for its metric alone.\n"));
}

// Removes the verdicts of a run's episodes.
RecordedRuns WithoutVerdicts(RecordedRuns runs) {
  for (RecordedEpisode& episode : runs.runs[0].episodes) {
    episode.success = false;
    episode.failure_reason = end_reason::kNotJudged;
  }
  return runs;
}

TEST_F(CompareTest, CompleteEpisodesWithoutAVerdictAreCountedAsSuch) {
  const RecordedRuns a = Run("a", Info(6), First(4, 6), 5), c = Run("c", Info(6), First(6, 6), 5);
  const RecordedRuns unjudged = WithoutVerdicts(Run("b", Info(6), First(6, 6), 6));
  const Comparison paired = CompareRuns(unjudged, a);
  EXPECT_EQ(Headline(paired), "No conclusion: no pair of episodes has a verdict on both sides");
  EXPECT_THAT(ComparisonText(paired, false), testing::HasSubstr("Means over the 6 pairs with equal seeds"));
  // The comparisons with the other runs are kept.
  EXPECT_EQ(Headline(CompareAll({unjudged, c}, a)),
            "c is not shown to differ from a; b has no verdict to compare");

  const Comparison unpaired = CompareRuns(WithoutVerdicts(Run("d", Info(4, 9), First(4, 4), 6)), a);
  EXPECT_EQ(Headline(unpaired), "No conclusion: d has no complete episode with a verdict");
  EXPECT_THAT(
      ComparisonText(unpaired, false),
      testing::HasSubstr("Means over 6 episodes of the baseline and 4 of the run; *: over their 4 and 0 "
                         "successes."));
  EXPECT_EQ(ComparisonJson({unpaired})["comparisons"][0]["success"]["test"], "Fisher, exact");
}

TEST_F(CompareTest, WithoutCompleteEpisodesThereIsNoDifference) {
  const RecordedRuns a = Run("a", Info(6), First(4, 6), 5);
  RecordedRuns none = Run("none", Info(6), First(6, 6), 6), also = Run("also", Info(6), First(6, 6), 6);
  for (RecordedRuns* runs : {&none, &also}) {
    for (RecordedEpisode& episode : runs->runs[0].episodes) episode.complete = false;
  }
  const Comparison with_none = CompareRuns(none, a);
  const std::string text = ComparisonText(with_none, true);
  EXPECT_THAT(text, testing::HasSubstr("\n\nNo conclusion: none has no complete episode.\n\n"));
  EXPECT_THAT(text, testing::ContainsRegex("\nsuccess +67 % +- +- +- +- +-\n"));
  EXPECT_THAT(text, Not(testing::HasSubstr("Mann-Whitney")));
  EXPECT_THAT(text, Not(testing::HasSubstr("Effort relative")));
  const nlohmann::ordered_json json = ComparisonJson({with_none});
  const nlohmann::ordered_json& success = json["comparisons"][0]["success"];
  for (const char* key : {"difference", "p", "p_holm"}) EXPECT_TRUE(success[key].is_null()) << key;
  EXPECT_EQ(success["difference_95"], nlohmann::ordered_json({nullptr, nullptr}));
  EXPECT_EQ(Headline(CompareRuns(none, also)), "No conclusion: neither none nor also has a complete episode");
}

// Returns a suite of two runs. The second one gets a different variation.
RecordedRuns Suite(RecordedRuns first, const RecordedRuns& second) {
  first.runs.push_back(second.runs[0]);
  first.runs.back().variation = "base";
  first.is_suite = true;
  return first;
}

// A task that only one side has must not count, because only that side's rate would include it.
TEST_F(CompareTest, RatesOverAllTasksCoverOnlyTasksThatBothSidesHave) {
  const RecordedRuns a = Suite(Run("a", Info(50), First(0, 50), 5), Run("c", Info(50), First(50, 50), 5));
  RecordedRuns b = Suite(Run("b", Info(50), First(0, 50), 5), Run("d", Info(50), First(0, 50), 5));
  for (RecordedEpisode& episode : b.runs[1].episodes) episode.complete = false;
  const Comparison result = CompareRuns(b, a);
  EXPECT_TRUE(result.success.paired);
  EXPECT_EQ(result.success.trials, 50);
  EXPECT_EQ(result.success.baseline_trials, 50);
  EXPECT_EQ(result.success.baseline_successes, 0);
  EXPECT_EQ(result.success.judgment(), Judgment::kNone) << Conclusion(result);
  EXPECT_THAT(result.remarks,
              Contains("lift_pot/base: excluded from the rates over all tasks: no verdicts to "
                       "compare"));
  EXPECT_THAT(result.remarks, Not(Contains(testing::HasSubstr("no seed in common"))));
}

TEST_F(CompareTest, VerdictsOfDifferentTasksAreNotCompared) {
  RecordedRuns a = Suite(Run("a", Info(50), First(0, 50), 5), Run("c", Info(50), First(50, 50), 5));
  RecordedRuns b = Suite(Run("b", Info(50), First(0, 50), 5), Run("d", Info(50), First(0, 50), 5));
  for (RecordedRun* run : {&a.runs[0], &b.runs[1]}) {
    for (RecordedEpisode& episode : run->episodes) episode.complete = false;
  }
  const Comparison result = CompareRuns(b, a);
  EXPECT_EQ(result.success.trials, 0);
  EXPECT_EQ(result.success.baseline_trials, 0);
  EXPECT_EQ(Headline(result), "No conclusion: no task has episodes with a verdict on both sides");
}

TEST_F(CompareTest, RatiosAreOmittedIfNoMetricOfEffortIsChosen) {
  const RecordedRuns a = Run("a", Info(6), First(6, 6), 5), b = Run("b", Info(6), First(6, 6), 6);
  EXPECT_THAT(ComparisonText(CompareAll({b}, a)[0], true), testing::HasSubstr("Effort relative to a"));
  EXPECT_THAT(ComparisonText(CompareAll({b}, a, {"success"})[0], true),
              Not(testing::HasSubstr("Effort relative to a")));
  const RecordedRuns failed = Run("c", Info(6), First(0, 6), 6);
  EXPECT_THAT(ComparisonText(CompareAll({failed}, a)[0], true), testing::HasSubstr("there are none."));
}

TEST_F(CompareTest, RemarksThatAPlanStoppedByItsResults) {
  ordered_json info = Info(4);
  info["until"] = "decided(alpha 0.05, max 200)";
  const RecordedRuns b = Run("b", info, First(4, 4), 5), a = Run("a", Info(4), First(4, 4), 6);
  EXPECT_THAT(
      CompareRuns(b, a).remarks,
      testing::Contains("b: its plan stopped depending on its results (until: decided(alpha 0.05, max 200)): "
                        "p values here assume a fixed number of episodes; use those of the plan's report"));
  EXPECT_THAT(CompareAll({b}, a).front().remarks, testing::Contains(testing::HasSubstr("fixed number")));
  EXPECT_THAT(CompareAll({b}, a, {}, true).front().remarks,
              testing::Not(testing::Contains(testing::HasSubstr("fixed number"))))
      << "the caller replaces p";
}

TEST_F(CompareTest, ASequentialTestIsNamedAndDecidesByItself) {
  Comparison result = CompareRuns(Run("b", Info(10), First(10, 10), 5), Run("a", Info(10), First(3, 10), 5));
  EXPECT_EQ(result.success.judgment(), Judgment::kBetter);
  result.success.family = 2;
  result.success.SetSequential(0.06, 0.12, false);
  EXPECT_EQ(result.success.judgment(), Judgment::kNone);
  EXPECT_THAT(Conclusion(result),
              testing::EndsWith("McNemar valid at any look, adjusted with Bonferroni's method, p = 0.120."));
  const ordered_json json = ComparisonJson({result})["comparisons"][0]["success"];
  EXPECT_EQ(json["test"], "McNemar, valid at any look");
  EXPECT_FALSE(json.contains("findable_difference")) << json;
  // A plan may choose a level other than 5 %.
  result.success.SetSequential(0.03, 0.06, true);
  EXPECT_EQ(result.success.judgment(), Judgment::kBetter);
  EXPECT_TRUE(Headline(result).starts_with("b is 70 points better than a, ")) << Headline(result);
}

TEST_F(CompareTest, SeveralAreAdjusted) {
  const RecordedRuns a = Run("a", Info(6), First(0, 6), 5);
  const auto results = CompareAll({Run("b", Info(6), First(6, 6), 5), Run("c", Info(6), First(1, 6), 5)}, a);
  EXPECT_DOUBLE_EQ(results[0].success.p, 1.0 / 32);
  EXPECT_DOUBLE_EQ(results[0].success.p_adjusted, 1.0 / 16);
  EXPECT_TRUE(Conclusion(results[0]).starts_with("No difference shown")) << Conclusion(results[0]);
  // Every adjusted p is called adjusted, even the largest, which Holm's method leaves unchanged.
  EXPECT_EQ(results[1].success.p_adjusted, results[1].success.p);
  for (const Comparison& result : results)
    EXPECT_THAT(Evidence(result), testing::HasSubstr(", exact McNemar, adjusted with Holm's method, p = "));
}

TEST_F(CompareTest, OnlyTheChosenMetrics) {
  const RecordedRuns a = Run("a", Info(6), First(6, 6), 5), b = Run("b", Info(6), First(6, 6), 6);
  const auto names = [&](const std::vector<std::string>& on) {
    std::vector<std::string> result;
    const std::vector<Comparison> comparisons = CompareAll({b}, a, on);
    for (const MetricComparison& metric : comparisons[0].tasks[0].metrics)
      result.push_back(metric.number.name);
    return result;
  };
  EXPECT_THAT(names({}), testing::ElementsAre("completion_time", "subtask_progress", "slip_count"));
  EXPECT_THAT(names({"slips", "success"}), testing::ElementsAre("slip_count"));
  EXPECT_THAT(names({"success"}), testing::IsEmpty());
  EXPECT_THAT(CompareAll({b}, a, {"slips"})[0].on, testing::ElementsAre("slips"));
  const auto error = [&](const std::vector<std::string>& on) {
    try {
      names(on);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(
      error({"slip_cuont"}),
      testing::StartsWith("--on slip_cuont: no such metric in both runs; did you mean 'slip_count'?"));
  EXPECT_EQ(error({"slips", "slip_count"}), "--on slip_count: is given twice");
}

TEST_F(CompareTest, SuitesByTask) {
  const auto suite = [&](const std::string& name, int successes) {
    RecordedRuns runs{.folder = name, .name = name, .is_suite = true, .runs = {}, .missing = {}};
    for (const char* variation : {"position", "base"}) {
      runs.runs.push_back(Run(name + variation, Info(8), First(successes, 8), 5).runs[0]);
      runs.runs.back().variation = variation;
    }
    return runs;
  };
  RecordedRuns b = suite("b", 8);
  const Comparison result = CompareRuns(b, suite("a", 3));
  ASSERT_EQ(result.tasks.size(), 2u);
  EXPECT_EQ(result.success.trials, 16);
  EXPECT_EQ(result.success.pairs.only_a, 10);
  EXPECT_DOUBLE_EQ(result.tasks[0].success.p, 2.0 / 32);
  EXPECT_DOUBLE_EQ(result.tasks[0].success.p_adjusted, 4.0 / 32);
  EXPECT_NE(ComparisonText(result, false).find("lift_pot/base"), std::string::npos);
  b.runs.pop_back();
  b.missing = {"lift_pot-base"};
  const std::vector<std::string> remarks = CompareRuns(b, suite("a", 3)).remarks;
  EXPECT_EQ(remarks.front(), "lift_pot/base is not in b: excluded");
  EXPECT_THAT(remarks, Contains("b/lift_pot-base: no finished episode"));
}

// Five pairs that only one policy wins have p = 2 / 32.
// The differences of two tasks cancel each other out in the sum.
TEST_F(CompareTest, HeadlineNamesTasksThatDiffer) {
  const auto suite = [&](const std::string& name, int on_first, int on_second) {
    RecordedRuns runs = Run(name + "1", Info(20), First(on_first, 20), 5);
    RecordedRuns other = Run(name + "2", Info(20), First(on_second, 20), 5);
    other.runs[0].variation = "base";
    runs.runs.push_back(other.runs[0]);
    runs.name = name;
    runs.is_suite = true;
    return runs;
  };
  const RecordedRuns a = suite("a", 10, 10), b = suite("b", 20, 1), c = suite("c", 10, 10);
  const Comparison result = CompareRuns(b, a);
  EXPECT_THAT(Headline(result), testing::StartsWith("No difference shown between b and a over all tasks: "));
  EXPECT_THAT(Headline(result), testing::EndsWith("; better on lift_pot/position, worse on lift_pot/base"));
  EXPECT_EQ(Headline(CompareAll({b, c}, a)),
            "b (better on lift_pot/position, worse on lift_pot/base) and c are not shown to differ from a");
  EXPECT_THAT(Headline(CompareRuns(c, a)), testing::StartsWith("No difference shown between c and a: "));
}

TEST(PText, RoundsHalvesUp) {
  EXPECT_EQ(PText(0.0625), "0.063");
  EXPECT_EQ(PText(0.3125), "0.313");
  EXPECT_EQ(PText(0.0009), "<0.001");
  EXPECT_EQ(PText(0.001), "0.001");
  EXPECT_EQ(PText(0.9996), "1.000");
  // Significant values are not rounded to 0.05.
  EXPECT_EQ(PText(0.0494), "0.049");
  EXPECT_EQ(PText(0.04996), "0.0499");
  EXPECT_EQ(PText(0.05), "0.050");
}

}  // namespace evalbus::results::comparison_test
