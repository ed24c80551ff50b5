#include "metrics/statistics/run_statistics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "metrics/statistics/clopper_pearson.h"
#include "metrics/statistics/confidence_sequence.h"
#include "metrics/statistics/interval_of_mean.h"

namespace evalbus::metrics::run_statistics_test {

using nlohmann::ordered_json;

EpisodeResult Episode(bool complete, bool success, const ordered_json& metrics) {
  return {.complete = complete,
          .success = success,
          .failure_reason = success ? "" : "timeout",
          .values = FlattenedValues(metrics),
          .stages = {},
          .slips = {},
          .collisions = {},
          .parameters = {},
          .final_poses = {}};
}

RunStatistics StatisticsOf(const std::vector<EpisodeResult>& episodes) {
  RunStatistics statistics;
  for (size_t i = 0; i < episodes.size(); ++i) statistics.Add(static_cast<int>(i), episodes[i]);
  return statistics;
}

TEST(RunStatistics, CountOnlyCompleteEpisodes) {
  const RunSummary summary =
      StatisticsOf(
          {
              Episode(true, true, {{"path", {{"left", 1.0}, {"right", 5}}}, {"held", true}}),
              Episode(true, false, {{"path", {{"left", 2.0}, {"right", 5}}}, {"held", false}}),
              Episode(true, true, {{"path", {{"left", 6.0}, {"right", 5}}}, {"held", true}, {"error", 0.5}}),
              Episode(false, true, {{"path", {{"left", 1000.0}, {"right", 1000}}}}),
              Episode(true, true, {{"path", {{"left", 3.0}, {"right", 5}}}, {"held", true}}),
          })
          .Summary(false);

  EXPECT_EQ(summary.episodes, 5);
  EXPECT_EQ(summary.complete, 4);
  EXPECT_EQ(summary.successes, 3);
  EXPECT_EQ(summary.success_rate, 0.75);
  EXPECT_EQ(summary.wilson.lower, WilsonInterval(3, 4).lower);
  EXPECT_NEAR(summary.clopper_pearson.lower, 0.194120, 1e-6);  // scipy's binomtest(3, 4)
  ASSERT_EQ(summary.metrics.size(), 4u);
  const MetricSummary& left = summary.metrics[0];
  EXPECT_EQ(left.name, "path.left");
  EXPECT_EQ(left.episodes, 4);
  EXPECT_EQ(left.mean, 3);
  EXPECT_NEAR(left.std, std::sqrt((4 + 1 + 0 + 9) / 3.0), 1e-15);
  EXPECT_EQ(left.median, 2.5);
  EXPECT_DOUBLE_EQ(left.p5, 1.15);
  EXPECT_DOUBLE_EQ(left.p95, 5.55);
  EXPECT_EQ(left.min, 1);
  EXPECT_EQ(left.max, 6);
  EXPECT_TRUE(std::isnan(left.mean_95.lower));
  EXPECT_EQ(summary.Find("path.right")->std, 0);
  EXPECT_EQ(summary.Find("held")->mean, 0.75);
  EXPECT_EQ(summary.Find("held")->std, 0.5);
  EXPECT_EQ(summary.Find("error")->episodes, 1);
  EXPECT_TRUE(std::isnan(summary.Find("error")->std));
  EXPECT_EQ(summary.Find("nothing"), nullptr);
}

TEST(RunStatistics, EqualEpisodesAreOneSample) {
  const auto same = Episode(true, true, {{"path", 1.5}});
  const RunSummary summary = StatisticsOf({same, same, same}).Summary(true);
  EXPECT_EQ(summary.complete, 3);
  EXPECT_EQ(summary.successes, 3);
  EXPECT_EQ(summary.success_rate, 1);
  EXPECT_EQ(summary.samples, 1);
  EXPECT_EQ(summary.wilson.lower, WilsonInterval(1, 1).lower);
  EXPECT_DOUBLE_EQ(summary.clopper_pearson.lower, 0.025);
  EXPECT_TRUE(std::isnan(summary.metrics[0].std));
  EXPECT_TRUE(std::isnan(summary.metrics[0].mean_95.lower));
  EXPECT_EQ(summary.SamplesText(),
            "all 3 episodes have equal starts and equal numbers: the interval counts them as one");
  EXPECT_EQ(SummaryJson("a", "b", summary)["samples"], 1);
}

// Equal numbers from different initial states are separate samples, because the numbers may not depend on the
// initial state.
TEST(RunStatistics, EqualEpisodesFromDifferentStartsAreAsManySamples) {
  auto first = Episode(true, false, {{"path", 1.5}}), second = first;
  first.parameters = {{"cube_yaw_rad", 0.1}};
  second.parameters = {{"cube_yaw_rad", 0.2}};
  EXPECT_EQ(StatisticsOf({first, second, second}).Summary(false).samples, 3);
  // The same initial state was drawn each time.
  EXPECT_EQ(StatisticsOf({first, first, first}).Summary(false).samples, 1);
}

// The policy is not deterministic, so 15 equal successes and 15 equal failures are 30 samples.
TEST(RunStatistics, EqualStartsThatEndDifferentlyAreAsManySamples) {
  RunStatistics statistics;
  for (int i = 0; i < 30; ++i) statistics.Add(i, Episode(true, i % 2 == 0, {{"path", 1.5}}));
  const RunSummary summary = statistics.Summary(false);
  EXPECT_EQ(summary.samples, 30);
  EXPECT_EQ(summary.success_rate, 0.5);
  EXPECT_EQ(summary.wilson.lower, WilsonInterval(15, 30).lower);
}

TEST(RunStatistics, OfASuiteCountSamplesByTask) {
  RunStatistics statistics;
  for (int i = 0; i < 10; ++i) statistics.Add(i, Episode(true, true, {{"path", 1.5}}), 0);
  for (int i = 10; i < 20; ++i) statistics.Add(i, Episode(true, i < 14, {{"path", i}}), 1);
  const RunSummary summary = statistics.Summary(false);
  EXPECT_EQ(summary.complete, 20);
  EXPECT_EQ(summary.samples, 11);
  EXPECT_EQ(summary.success_rate, 0.7);
  EXPECT_EQ(summary.wilson.lower, WilsonInterval(14 * 11 / 20.0, 11).lower);
  EXPECT_EQ(summary.SamplesText(),
            "the interval counts 11 episodes instead of 20: a task whose episodes all have equal starts and "
            "equal numbers counts as one");
}

// The time at which a failed episode ended is not a completion time.
TEST(RunStatistics, CompletionTimeIsThatOfSuccesses) {
  const RunSummary summary = StatisticsOf({Episode(true, true, {{"completion_time", 4}, {"path", 1}}),
                                           Episode(true, false, {{"completion_time", 30}, {"path", 2}}),
                                           Episode(true, true, {{"completion_time", 6}, {"path", 3}})})
                                 .Summary(true);
  EXPECT_EQ(summary.Find("completion_time")->episodes, 2);
  EXPECT_EQ(summary.Find("completion_time")->mean, 5);
  EXPECT_EQ(summary.Find("completion_time")->max, 6);
  EXPECT_EQ(summary.Find("path")->episodes, 3);
  EXPECT_EQ(
      StatisticsOf({Episode(true, false, {{"completion_time", 30}})}).Summary(true).Find("completion_time"),
      nullptr);
}

TEST(RunStatistics, SomeEqualEpisodesNarrowNoInterval) {
  const auto same = Episode(true, true, {{"path", 1.5}});
  // An incomplete episode is not a sample.
  const RunSummary summary =
      StatisticsOf({same, Episode(true, false, {{"path", 1.5}}), same, Episode(true, true, {{"path", 2}}),
                    Episode(false, true, {{"path", 3}})})
          .Summary(true);
  EXPECT_EQ(summary.samples, 4);
  EXPECT_EQ(summary.success_rate, 0.75);
  EXPECT_EQ(summary.wilson.lower, WilsonInterval(3, 4).lower);
  EXPECT_FALSE(std::isnan(summary.metrics[0].mean_95.lower));
}

TEST(RunStatistics, EpisodesThatDifferAreAsManySamples) {
  const RunSummary summary =
      StatisticsOf({Episode(true, true, {{"path", 1.5}}), Episode(true, true, {{"path", 1.6}})})
          .Summary(true);
  EXPECT_EQ(summary.samples, 2);
  EXPECT_EQ(summary.SamplesText(), "");
  EXPECT_FALSE(SummaryJson("a", "b", summary).contains("samples"));
}

TEST(RunStatistics, CountStagesReasonsSlipsAndCollisions) {
  const auto episode = [](bool success, bool second, int slips, const std::string& reason) {
    EpisodeResult result =
        Episode(true, success, {{"slip_count_per_object", {{"object_1", slips}, {"object_2", 0}}}});
    result.stages = {{1, true}, {2, second}};
    result.slips = {slips, 0};
    result.failure_reason = reason;
    return result;
  };
  std::vector<EpisodeResult> episodes = {
      episode(true, true, 1, ""), episode(false, false, 2, "timeout"), episode(false, true, 0, "dropped"),
      episode(false, false, 0, "timeout"), episode(false, true, 9, "unstable")};
  episodes[0].collisions = {{"counter", 2}};
  episodes[2].collisions = {{"counter", 1}, {"left/hand + right/hand", 4}};
  episodes[4].collisions = {{"counter", 7}};
  episodes[4].complete = false;
  const RunSummary summary = StatisticsOf(episodes).Summary(false);

  using Counts = std::vector<std::pair<std::string, int64_t>>;
  ASSERT_EQ(summary.stages.size(), 2u);
  EXPECT_EQ(summary.stages[0].index, 1);
  EXPECT_EQ(summary.stages[0].reached, 4);
  EXPECT_EQ(summary.stages[1].reached, 2);
  EXPECT_EQ(summary.failure_reasons,
            (std::vector<std::pair<std::string, int>>{{"timeout", 2}, {"dropped", 1}}));
  EXPECT_EQ(summary.slips_per_object, (std::vector<int64_t>{3, 0}));
  EXPECT_EQ(summary.collisions_per_geom, (Counts{{"left/hand + right/hand", 4}, {"counter", 3}}));
  EXPECT_EQ(summary.metrics.size(), 2u);

  const run_summary_t message = SummaryMessage(summary);
  EXPECT_EQ(message.num_episodes, 5);
  EXPECT_EQ(message.num_complete, 4);
  EXPECT_EQ(message.success_rate_anytime_lower, ConfidenceSequence(1, 4).lower);
  EXPECT_EQ(message.success_rate_anytime_upper, ConfidenceSequence(1, 4).upper);
  EXPECT_EQ(message.success_rate_wilson_lower, WilsonInterval(1, 4).lower);
  EXPECT_EQ(message.success_rate_clopper_pearson_upper, ClopperPearsonInterval(1, 4).upper);
  EXPECT_EQ(message.stage_index, (std::vector<int32_t>{1, 2}));
  EXPECT_EQ(message.stage_episodes, (std::vector<int32_t>{4, 2}));
  EXPECT_EQ(message.failure_reason, (std::vector<std::string>{"timeout", "dropped"}));
  EXPECT_EQ(message.failure_episodes, (std::vector<int32_t>{2, 1}));
  EXPECT_EQ(message.metric_name[0], "slip_count_per_object.object_1");
  EXPECT_EQ(message.mean_mixed[0], 0.75);
  EXPECT_EQ(message.max_mixed[0], 2);

  const ordered_json json = SummaryJson("lift_pot", "base", summary);
  EXPECT_EQ(json["stages"]["2"]["reached"], 2);
  EXPECT_EQ(json["stages"]["2"]["share"], 0.5);
  EXPECT_EQ(json["collisions_per_geom"]["counter"], 3);
  EXPECT_EQ(json["slips_per_object"].dump(), R"({"object_1":3,"object_2":0})");
  EXPECT_EQ(json["failure_reasons"].dump(), R"({"timeout":2,"dropped":1})");
}

TEST(RunStatistics, LastResultOfAnEpisodeCounts) {
  RunStatistics statistics;
  statistics.Add(0, Episode(true, false, {{"x", 1.0}, {"y", 1}}));
  statistics.Add(1, Episode(true, true, {{"x", 2.0}}));
  statistics.Add(0, Episode(true, true, {{"x", 5.0}}));
  statistics.Add(1, Episode(false, true, {{"x", 2.0}}));
  const RunSummary summary = statistics.Summary(false);
  EXPECT_EQ(summary.episodes, 2);
  EXPECT_EQ(summary.complete, 1);
  EXPECT_EQ(summary.successes, 1);
  EXPECT_TRUE(summary.failure_reasons.empty());
  ASSERT_EQ(summary.metrics.size(), 1u);
  EXPECT_EQ(summary.metrics[0].mean, 5);
}

TEST(RunStatistics, HaveTheSameBitsInAnyOrder) {
  RunStatistics forth, back;
  for (int i = 0; i < 60; ++i) {
    forth.Add(i, Episode(true, true, {{"x", std::exp(std::sin(i))}}));
    back.Add(59 - i, Episode(true, true, {{"x", std::exp(std::sin(59 - i))}}));
  }
  EXPECT_EQ(SummaryJson("lift_pot", "base", forth.Summary(true)),
            SummaryJson("lift_pot", "base", back.Summary(true)));
}

TEST(RunStatistics, BootstrapTheMean) {
  RunStatistics statistics;
  std::vector<double> sorted;
  for (int i = 0; i < 20; ++i) {
    sorted.push_back(i * i);
    statistics.Add(i, Episode(true, true, {{"x", i * i}}));
  }
  const ordered_json metric = SummaryJson("lift_pot", "base", statistics.Summary(true))["metrics"]["x"];
  const Interval expected = IntervalOfMean(sorted);
  EXPECT_EQ(metric["mean_95"], (std::vector<double>{expected.lower, expected.upper}));
  EXPECT_LT(expected.lower, metric["mean"]);
  EXPECT_GT(expected.upper, metric["mean"]);
}

TEST(RunStatistics, OfNothingHaveNoRate) {
  const RunSummary summary = StatisticsOf({Episode(false, true, {})}).Summary(true);
  EXPECT_EQ(summary.episodes, 1);
  EXPECT_EQ(summary.complete, 0);
  EXPECT_TRUE(std::isnan(summary.success_rate));
  EXPECT_EQ(summary.wilson.lower, 0);
  EXPECT_EQ(summary.wilson.upper, 1);
  EXPECT_EQ(SummaryJson("lift_pot", "base", summary)["success_rate"].dump(), "null");
}

TEST(RunStatistics, CountStartsSeenInTraining) {
  EpisodeResult seen = Episode(true, true, {{"x", 1}}), unseen = Episode(true, false, {{"x", 2}});
  EpisodeResult incomplete = Episode(false, false, {});
  const auto summary_of = [&] { return StatisticsOf({seen, unseen, unseen, incomplete}).Summary(false); };
  EXPECT_EQ(summary_of().TrainingText(), "");
  EXPECT_FALSE(SummaryJson("lift_pot", "base", summary_of()).contains("seen_in_training"));
  seen.seen_in_training = incomplete.seen_in_training = true;
  unseen.seen_in_training = false;
  EXPECT_EQ(summary_of().TrainingText(), "1 of 3 starts were seen in training");
  EXPECT_EQ(SummaryJson("lift_pot", "base", summary_of())["seen_in_training"], 1);
  seen.seen_in_training = false;
  EXPECT_EQ(summary_of().TrainingText(), "0 of 3 starts were seen in training");
  EXPECT_EQ(SummaryJson("lift_pot", "base", summary_of())["seen_in_training"], 0);
}

TEST(RunStatistics, CountEpisodesThatWereDecidedAtTheStart) {
  EpisodeResult later = Episode(true, true, {}), at_once = later, incomplete = Episode(false, true, {});
  at_once.decided_at_start = incomplete.decided_at_start = true;
  EXPECT_EQ(StatisticsOf({later, incomplete}).Summary(false).StartText(), "");
  EXPECT_EQ(
      StatisticsOf({later, at_once}).Summary(false).StartText(),
      "1 of 2 episodes were decided at the first tick: success or failure is true at the start, whatever "
      "the policy does");
}

// The run has two episodes of 5 s.
TEST(RunStatistics, NoteManyClippedValues) {
  const auto text = [](int clips, int unreachable) {
    const ordered_json metrics = {
        {"completion_time", 5}, {"extended", {{"action_clips", clips}, {"unreachable_poses", unreachable}}}};
    const EpisodeResult failure = Episode(true, false, metrics);
    return StatisticsOf({failure, Episode(true, true, metrics)}).Summary(false).ActionsText();
  };
  const std::string clipped =
      "40 commanded values per second were clipped to their limits: is the unit or scale wrong?";
  EXPECT_EQ(text(4, 4), "");
  EXPECT_EQ(text(200, 4), clipped);
  EXPECT_EQ(text(200, 5),
            clipped + "; 1 commanded wrist poses per second were out of reach: is the frame or unit wrong?");
}

TEST(RunStatistics, CountSuccessesThatDidNotReachEveryStage) {
  EpisodeResult whole = Episode(true, true, {}), early = whole, failure = Episode(true, false, {});
  whole.stages = {{1, true}, {2, true}};
  early.stages = failure.stages = {{1, false}, {2, true}};
  EXPECT_EQ(StatisticsOf({whole, failure}).Summary(false).StagesText(), "");
  EXPECT_EQ(StatisticsOf({whole, early, failure}).Summary(false).StagesText(),
            "1 of 2 successes did not reach every stage: stages are not conditions of success");
  EXPECT_FALSE(SummaryJson("a", "b", StatisticsOf({whole, failure}).Summary(false)).contains("notes"));
  EXPECT_EQ(
      SummaryJson("a", "b", StatisticsOf({whole, early, failure}).Summary(false))["notes"],
      ordered_json({"1 of 2 successes did not reach every stage: stages are not conditions of success"}));
  EXPECT_EQ(StatisticsOf({early}).Summary(false).StagesText(),
            "1 of 1 success did not reach every stage: stages are not conditions of success");
}

// Six poses are 1 mm and 0.01 rad from the middle, and six are 3 mm and 0.03 rad from it, half of them on
// each side. The barycenter is therefore the middle, the mean deviation is 2, and its standard deviation is
// sqrt(12 / 11).
std::vector<EpisodeResult> Scattered() {
  std::vector<EpisodeResult> episodes;
  for (int i = 0; i < 12; ++i) {
    const double deviation = (i < 6 ? 1 : 3) * (i % 2 == 0 ? 1 : -1);
    // The poses are rotated about x by a quarter turn plus the deviation. Half of the quaternions have the
    // opposite sign.
    const double half = M_PI / 4 + deviation * 0.01 / 2, sign = i % 4 < 2 ? 1 : -1;
    episodes.push_back(Episode(true, true, {{"x", i}}));
    episodes.back().is_start_known = true;
    episodes.back().final_poses = {
        {"pot", {{0.5, 0.2 + deviation * 1e-3, 1}, {sign * std::cos(half), sign * std::sin(half), 0, 0}}}};
  }
  return episodes;
}

TEST(Repeatability, IsTheMeanPlusThreeStandardDeviations) {
  std::vector<EpisodeResult> episodes = Scattered();
  // Neither failures nor incomplete episodes count.
  for (const bool is_complete : {true, false}) {
    episodes.push_back(Episode(is_complete, !is_complete, {}));
    episodes.back().is_start_known = true;
    episodes.back().final_poses = {{"pot", {{9, 9, 9}, {1, 0, 0, 0}}}};
  }
  const RunSummary summary = StatisticsOf(episodes).Summary(true);
  ASSERT_EQ(summary.repeatability.size(), 1u);
  const double deviations = 2 + 3 * std::sqrt(12.0 / 11);
  EXPECT_EQ(summary.repeatability[0].episodes, 12);
  ASSERT_EQ(summary.repeatability[0].poses.size(), 1u);
  EXPECT_EQ(summary.repeatability[0].poses[0].first, "pot");
  EXPECT_NEAR(summary.repeatability[0].poses[0].second.position, deviations * 1e-3, 1e-12);
  EXPECT_NEAR(summary.repeatability[0].poses[0].second.rotation, deviations * 0.01, 1e-12);
  const ordered_json json = SummaryJson("lift_pot", "base", summary)["repeatability"];
  ASSERT_EQ(json.size(), 1u);
  EXPECT_EQ(json[0]["parameters"].dump() + json[0]["episodes"].dump(), "{}12");
  EXPECT_NEAR(json[0]["poses"]["pot"]["position_m"], 0.0051334, 1e-7);
  EXPECT_TRUE(StatisticsOf(episodes).Summary(false).repeatability.empty()) << "while the run is active";
}

TEST(Repeatability, RequiresTenSuccessesThatBeganAlike) {
  const auto starts = [](const std::vector<EpisodeResult>& episodes) {
    return StatisticsOf(episodes).Summary(true).repeatability.size();
  };
  std::vector<EpisodeResult> episodes = Scattered();
  episodes.resize(10);
  EXPECT_EQ(starts(episodes), 1u);
  episodes[9].is_start_known = false;
  EXPECT_EQ(starts(episodes), 0u) << "nine known starts";
  episodes[9].is_start_known = true;
  episodes[9].parameters = {{"pot_x_m", 0.1}};
  EXPECT_EQ(starts(episodes), 0u) << "nine equal starts";
  // The episodes are equal in every number. They are one sample without scatter.
  EXPECT_EQ(starts(std::vector(10, Scattered()[0])), 0u);

  // There are two initial states with twelve episodes each.
  std::vector<EpisodeResult> two = Scattered();
  for (EpisodeResult episode : Scattered()) {
    episode.parameters = {{"pot_x_m", 0.1}};
    two.push_back(episode);
  }
  EXPECT_EQ(starts(two), 2u);
}

TEST(ResultOf, TakesALineOfEpisodes) {
  ordered_json line = ordered_json::parse(R"({"episode": 3, "end_reason": "time_limit", "complete": true,
      "failure_reason": "dropped", "metrics": {"success": 0.0, "task_stage_reached": {"1": true, "12": false},
      "slip_count_per_object": {"object_1": 2, "object_2": 0}, "path": {"left": 2}}, "extended": {"y": 3},
      "parameters": {"pot_x_m": 0.25},
      "final_poses": {"pot": {"x_m": 1, "y_m": 2, "z_m": 3, "qw": 0.6, "qx": 0, "qy": 0, "qz": 0.8}},
      "explanation": {"text": "", "collisions_per_geom": {"counter": 2}}})");
  const EpisodeResult result = ResultOf(line);
  EXPECT_TRUE(result.complete);
  EXPECT_FALSE(result.success);
  EXPECT_EQ(result.failure_reason, "dropped");
  // Success and stages are rates, not metrics with a mean.
  EXPECT_EQ(result.values, (NamedNumbers{{"slip_count_per_object.object_1", 2},
                                         {"slip_count_per_object.object_2", 0},
                                         {"path.left", 2},
                                         {"extended.y", 3}}));
  EXPECT_EQ(result.stages, (std::vector<std::pair<int, bool>>{{1, true}, {12, false}}));
  EXPECT_EQ(result.slips, (std::vector<int64_t>{2, 0}));
  EXPECT_EQ(result.collisions, (std::map<std::string, int64_t>{{"counter", 2}}));
  EXPECT_EQ(result.parameters, (NamedNumbers{{"pot_x_m", 0.25}}));
  EXPECT_TRUE(result.is_start_known);
  EXPECT_EQ(result.final_poses, (NamedPoses{{"pot", {{1, 2, 3}, {0.6, 0, 0, 0.8}}}}));
  EXPECT_EQ(PosesJson(result.final_poses), line["final_poses"]);

  const auto decided_at_start = [&](const char* end_reason, int tick) {
    line["end_reason"] = end_reason;
    line["explanation"]["conditions"] = {{{"tick", tick}}};
    return ResultOf(line).decided_at_start;
  };
  EXPECT_FALSE(result.decided_at_start);
  EXPECT_TRUE(decided_at_start("failure", 1));
  EXPECT_FALSE(decided_at_start("failure", 2));
  EXPECT_FALSE(decided_at_start("time_limit", 1));

  EXPECT_EQ(result.seen_in_training, std::nullopt);
  line["seen_in_training"] = true;
  EXPECT_EQ(ResultOf(line).seen_in_training, true);

  line["metrics"]["task_stage_reached"] = {{"first", true}};
  EXPECT_THROW(ResultOf(line), InputError);
}

}  // namespace evalbus::metrics::run_statistics_test
