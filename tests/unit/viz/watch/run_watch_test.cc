// Tests the state that an observer derives from scripted messages, without a screen.
#include "viz/watch/run_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/viz/scripted_run.h"
#include "viz/watch/score_rows.h"

namespace evalbus::viz::run_watch_test {

using std::chrono::milliseconds;

class RunWatchTest : public testing::Test, protected ScriptedRun {};

TEST_F(RunWatchTest, KnowsNothingBeforeTheFirstMessage) {
  EXPECT_FALSE(watch_.received_at());
  EXPECT_EQ(watch_.episode(), -1);
  EXPECT_EQ(watch_.Phase(), "");
  EXPECT_EQ(watch_.scores(), nullptr);
  watch_.Update(now_);
  now_ += milliseconds(2500);
  EXPECT_EQ(watch_.SilentFor(now_), 2.5);
  EXPECT_TRUE(watch_.TakeEvents().empty());
}

TEST_F(RunWatchTest, FollowsAnEpisode) {
  PublishModel();
  PublishBegin(0);
  EXPECT_EQ(watch_.Phase(), "waiting for components");
  PublishStatus("sim", 0, -1);
  EXPECT_EQ(watch_.Phase(), "waiting for the next tick");
  PublishTick(0, 0, true);
  PublishTick(0, 1);
  EXPECT_EQ(watch_.Phase(), "running");
  EXPECT_EQ(watch_.state()->tick, 1);
  ASSERT_TRUE(watch_.has_scores());
  EXPECT_EQ(watch_.scores()->metrics.slip_count, 3);
  EXPECT_EQ(watch_.contacts()->header.tick, 1);
  EXPECT_EQ(watch_.clearance()->header.tick, 0) << "the last message with a clearance";
  EXPECT_EQ(watch_.GeomName(kLeftPad), "left/pad");
  EXPECT_EQ(watch_.GeomName(kLidGeom), "pot/lid") << "its body's name";
  EXPECT_EQ(watch_.GeomName(1000), "geom 1000");
  PublishSummary(0, "success");
  EXPECT_EQ(watch_.Phase(), "success");
  ASSERT_EQ(watch_.done().size(), 1u);
  EXPECT_EQ(watch_.run()->num_episodes, 1);

  PublishBegin(1);
  EXPECT_EQ(watch_.end_reason(), "");
  EXPECT_EQ(watch_.state(), nullptr);
  EXPECT_FALSE(watch_.has_scores());
  EXPECT_NE(watch_.scores(), nullptr) << "the last scores stay available";
  PublishTick(1, 0);
  EXPECT_TRUE(watch_.has_scores());
  PublishBegin(1, 2);
  EXPECT_EQ(watch_.attempt(), 2);
  EXPECT_FALSE(watch_.has_scores()) << "the scores belong to the previous attempt";
}

TEST_F(RunWatchTest, WarningsOfComponentsAreEvents) {
  PublishLog(log_t::INFO_LEVEL, "all is well");
  PublishLog(log_t::WARN_LEVEL, "no PARTIAL\nfrom metrics");
  EXPECT_EQ(watch_.TakeEvents(), std::vector<std::string>{"sim  e2 t127: no PARTIAL?from metrics"});
  for (int i = 0; i < 100; ++i) PublishLog(log_t::INFO_LEVEL, "again");
  EXPECT_EQ(watch_.log().size(), 20u);
}

TEST_F(RunWatchTest, MeasuresOverTheLastSecond) {
  Play();
  watch_.Update(now_);
  EXPECT_TRUE(watch_.has_rates());
  EXPECT_NEAR(watch_.speed(), 1, 1e-9);
  EXPECT_NEAR(watch_.channels().at(channels::kState.name).rate, 50, 1e-9);
  now_ += milliseconds(10000);
  watch_.Update(now_);
  EXPECT_LT(watch_.speed(), 0.1);
}

TEST_F(RunWatchTest, TimeIsTakenFromScoresIfNoStateIsReceived) {
  episode_begin_t begin{};
  watch_.Receive(begin, now_);
  partial_metrics_t partial{};
  for (int64_t tick = 1; tick <= 101; ++tick) {
    partial.header = Header(tick);
    watch_.Receive(partial, now_);
    now_ += milliseconds(10);
  }
  watch_.Update(now_);
  EXPECT_NEAR(watch_.speed(), 2, 0.1);
  EXPECT_TRUE(watch_.has_scores());
  partial.header = Header(102, 7);
  watch_.Receive(partial, now_);
  EXPECT_EQ(watch_.scores()->header.tick, 101) << "the last message belongs to another episode";
}

TEST_F(RunWatchTest, NoticesSilentComponentsAndTheirReturn) {
  Play();
  for (int i = 0; i < 5; ++i) {
    now_ += milliseconds(500);
    for (const char* name : {"metrics", "sim"}) PublishStatus(name, 2, 75);
  }
  watch_.Update(now_);
  EXPECT_TRUE(watch_.health().at("policy").silent);
  EXPECT_FALSE(watch_.health().at("metrics").silent);
  PublishStatus("policy", 2, 75);
  EXPECT_FALSE(watch_.health().at("policy").silent);
  const std::vector<std::string> events = watch_.TakeEvents();
  EXPECT_EQ(events.back(), "policy publishes again");
  EXPECT_TRUE(watch_.TakeEvents().empty());
  // A component that has announced its end is not reported as missing.
  PublishStatus("policy", 2, 75, component_status_t::STOPPED);
  now_ += milliseconds(5000);
  watch_.Update(now_);
  EXPECT_FALSE(watch_.health().at("policy").silent);
}

TEST_F(RunWatchTest, NoComponentIsMissedAfterTheEndOfTheRun) {
  Play();
  EXPECT_FALSE(watch_.is_over());
  PublishStatus("sim", 2, 75, component_status_t::STOPPED);
  EXPECT_FALSE(watch_.is_over()) << "the sim may be restarted";
  PublishStatus("run", 2, 75, component_status_t::STOPPED);
  EXPECT_TRUE(watch_.is_over());
  watch_.TakeEvents();
  now_ += milliseconds(60000);
  watch_.Update(now_);
  EXPECT_FALSE(watch_.health().at("policy").silent) << "the run has ended";
  EXPECT_TRUE(watch_.TakeEvents().empty());
  // The next run begins on this bus.
  PublishStatus("run", 0, -1);
  EXPECT_FALSE(watch_.is_over());
}

TEST_F(RunWatchTest, AnEpisodeHasTheReasonThatTheRunsTableHas) {
  PublishModel();
  PublishBegin(0);
  PublishTick(0, 0);
  watch_.TakeEvents();
  PublishSummary(0, "time_limit");
  EXPECT_EQ(watch_.Phase(), "slipped from the gripper");
  episode_end_t again{};
  again.header = Header(75, 0);
  again.end_reason = "time_limit";
  Publish(channels::kEpisodeEnd, again);
  EXPECT_EQ(watch_.Phase(), "slipped from the gripper")
      << "the end is repeated until the next episode begins";
  EXPECT_TRUE(watch_.TakeEvents().at(0).starts_with("episode 0 slipped from the gripper after 2.50 s"));
}

TEST_F(RunWatchTest, LagIsInTicksBehindTheSim) {
  PublishModel();
  PublishBegin(0);
  PublishStatus("recorder", 0, 37);
  EXPECT_EQ(watch_.health().at("recorder").lag, -1) << "no STATE yet";
  Publish(channels::kState, State(49, 0));
  PublishStatus("recorder", 0, 37);
  EXPECT_EQ(watch_.health().at("recorder").lag, 12);
  PublishStatus("recorder", 5, 37);
  EXPECT_EQ(watch_.health().at("recorder").lag, -1) << "the status belongs to another episode";
}

// The model's indices exceed the ends of its lists.
TEST_F(RunWatchTest, AModelThatContradictsItselfIsNone) {
  model_info_t model = small_world::Model();
  model.geom_body[3] = 1000;
  Publish(channels::kModel, model);
  EXPECT_EQ(watch_.model(), nullptr);
  EXPECT_EQ(watch_.undecodable(), 1);
  EXPECT_EQ(watch_.GeomName(3), "geom 3");
  PublishModel();
  EXPECT_NE(watch_.model(), nullptr);
}

TEST(ScoreRows, HaveTheCatalogsWordsAndNumbers) {
  const auto rows = ScoreRows(ScriptedRun::Metrics(), ScriptedRun::Extended());
  const auto find = [&](const std::string& label) {
    const auto row = std::ranges::find(rows, label, &ScoreRow::label);
    EXPECT_NE(row, rows.end()) << label;
    return *row;
  };
  EXPECT_EQ(find("wrist path").each, (std::vector<double>{1.25, 0.75}));
  EXPECT_EQ(find("wrist path").whole, 2);
  EXPECT_EQ(find("wrist jerk, rms").whole, 125);
  EXPECT_EQ(find("wrist jerk, mean").each, (std::vector<double>{100.5, 80}));
  EXPECT_EQ(find("servo work").whole, 7.5);
  EXPECT_EQ(find("servo work").of, (std::vector<std::string>{"left", "right"}));
  EXPECT_TRUE(std::isnan(find("peak wrist speed").whole)) << "speeds do not add up";
  EXPECT_EQ(find("left_gripper_to_pot").whole, 0.25);
  EXPECT_EQ(find("pose error").whole, 0.031);
  EXPECT_EQ(find("late actions").whole, 4);
  EXPECT_EQ(
      ScoreLine(ScriptedRun::Metrics(), ScriptedRun::Extended()),
      "stages 1/2  slips 3  collisions with the scene 2  self collisions 0  smallest clearance 12.00 mm  "
      "wrist path 2.000 m  wrist jerk, rms 125.0 m/s³");
}

TEST(ScoreRows, OfWhatIsNotTrackedThereAreNone) {
  metric_values_t values = ScriptedRun::Metrics();
  values.tracks_slippage = values.tracks_joint_jerk = 0;
  for (const ScoreRow& row : ScoreRows(values, {})) {
    EXPECT_NE(row.label, "slips");
    EXPECT_FALSE(row.label.starts_with("joint jerk")) << row.label;
    EXPECT_FALSE(row.metric->is_extended() && !row.metric->counter) << row.label;
  }
}

}  // namespace evalbus::viz::run_watch_test
