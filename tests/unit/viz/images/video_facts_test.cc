#include "viz/images/video_facts.h"

#include <gtest/gtest.h>

#include "lcmtypes/source.h"

namespace evalbus::viz::video_facts_test {

// An episode of one second whose last state is later than the decisive moment.
EpisodeMessages Episode(const std::string& end_reason, const std::string& failure_reason) {
  EpisodeMessages episode;
  episode.model = model_info_t{};
  episode.states.resize(1);
  episode.states[0].header.sim_time_us = 1'000'000;
  episode_summary_t summary{};
  summary.end_reason = end_reason;
  summary.failure_reason = failure_reason;
  summary.explanation.condition.resize(1);
  summary.explanation.condition[0].text = "tilt of pot 0.3 deg <= 20";
  summary.explanation.num_conditions = 1;
  summary.cause.kind = "any";
  summary.cause.time_s = 0.5;
  summary.cause.text = "Any cause at 0.50 s.";
  episode.summary = summary;
  return episode;
}

// Successes and failures are explained by the cause of the results, in the same words as on the pages.
TEST(VideoFacts, AreExplainedByTheCause) {
  for (const EpisodeMessages& episode : {Episode("success", ""), Episode("time_limit", "grasp_slip")}) {
    const VideoFacts facts = FactsOf(episode, {0}, "expert");
    EXPECT_EQ(facts.reason, "Any cause at 0.50 s.");
    EXPECT_EQ(facts.outcome_s, 0.5);
  }
  // Runs of older versions have no cause.
  EpisodeMessages older = Episode("success", "");
  older.summary->cause = {};
  EXPECT_EQ(FactsOf(older, {0}, "expert").reason, "tilt of pot 0.3 deg <= 20");
  EXPECT_EQ(FactsOf(older, {0}, "expert").outcome_s, 1);
}

// A source may lack the data that a count requires.
TEST(VideoFacts, CountsThatAreUnavailableHideNoOthers) {
  EpisodeMessages episode = Episode("success", "");
  partial_metrics_t& partial = episode.partials.emplace_back();
  partial.metrics.tracks_slippage = partial.metrics.tracks_collisions = true;
  partial.metrics.slip_count = partial.metrics.env_collision_count = kUnavailableCount;
  partial.metrics.self_collision_count = 1;
  const VideoFacts facts = FactsOf(episode, {0}, "expert");
  EXPECT_FALSE(facts.counts_slips);
  EXPECT_TRUE(facts.counts_collisions);
  ASSERT_EQ(facts.marks.size(), 1u);
  EXPECT_EQ(facts.marks[0].kind, VideoMark::Kind::kCollision);
}

}  // namespace evalbus::viz::video_facts_test
