#include "viz/viewer/run_block.h"

#include <gtest/gtest.h>

#include "bus/channels.h"
#include "bus/message.h"
#include "lcmtypes/source.h"
#include "tests/unit/small_world.h"
#include "viz/viewer/block.h"

namespace evalbus::viz::run_block_test {

SteadyTime At(double seconds) {
  return SteadyTime() +
         std::chrono::duration_cast<SteadyTime::duration>(std::chrono::duration<double>(seconds));
}

TEST(RunBlock, ShowsTheStateOfTheWatch) {
  RunWatch watch(10);
  const auto hear = [&](const auto& channel, const auto& message, double time) {
    watch.Receive(channel, Encode(message), At(time));
  };
  hear(channels::kModel, small_world::Model(), 0);
  episode_begin_t begin{};
  begin.header.episode = 4;
  hear(channels::kEpisodeBegin, begin, 0);
  component_status_t status{};
  status.component = "<b>sim\x1b";
  status.state = component_status_t::FAILED;
  status.error = "broke";
  hear(channels::kStatus, status, 0);
  run_summary_t run{};
  run.num_episodes = 5;
  run.num_complete = 4;
  run.num_success = 2;
  run.success_rate_anytime_lower = 0.25;
  run.success_rate_anytime_upper = 0.75;
  run.num_failure_reasons = 2;
  run.failure_reason = {"dropped", "not_judged"};
  run.failure_episodes = {1, 1};
  hear(channels::kRunSummary, run, 0.5);
  watch.Update(At(1));
  const BlockReader block(RunBlock(
      watch, {.run = 2, .name = "mine", .policy = "expert", .is_live = true, .remarks = {"a note"}}, At(1)));
  const auto& head = block.head();
  EXPECT_EQ(head["block"], "run");
  EXPECT_EQ(head["run"], 2);
  EXPECT_EQ(head["task"], "small");
  EXPECT_EQ(head["planned"], 10);
  EXPECT_EQ(head["episode"], 4);
  EXPECT_EQ(head["phase"], "waiting for components");
  EXPECT_EQ(head["done"], 5);
  EXPECT_EQ(head["judged"], 3);
  EXPECT_EQ(head["rate"], 2.0 / 3);
  EXPECT_EQ(head["interval"], (std::vector<double>{0.25, 0.75}));
  EXPECT_EQ(head["interval_kind"], "anytime");
  EXPECT_EQ(head["failure_reasons"][0], nlohmann::ordered_json::array({"dropped", 1}));
  ASSERT_EQ(head["components"].size(), 1u);
  EXPECT_EQ(head["components"][0]["name"], "<b>sim?");
  EXPECT_EQ(head["components"][0]["state"], "failed");
  EXPECT_EQ(head["components"][0]["is_bad"], true);
  EXPECT_EQ(head["remarks"][0], "a note");
  EXPECT_EQ(head["is_live"], true);
  EXPECT_TRUE(head["pacing"].is_null());
}

TEST(RunBlock, OfProcessesThatAreGoneTheFolderKnowsWhetherTheRunIsOver) {
  const RunWatch watch(2);
  for (const bool is_live : {true, false}) {
    for (const bool is_over : {true, false}) {
      RunNumbers numbers;
      numbers.is_over = is_over;
      RunLabel label;
      label.is_live = is_live;
      const BlockReader block(RunBlock(watch, label, At(1), &numbers));
      EXPECT_EQ(block.head()["is_over"], is_over && !is_live) << is_live << is_over;
    }
  }
}

TEST(RunBlock, RatesReferToEpisodesWithAVerdict) {
  RunNumbers numbers;
  numbers.complete = 5;
  numbers.judged = 4;
  numbers.successes = 3;
  EXPECT_EQ(BlockReader(RunBlock(numbers, RunLabel())).head()["rate"], 0.75);
  numbers.judged = numbers.successes = 0;
  const BlockReader none(RunBlock(numbers, RunLabel()));
  EXPECT_TRUE(none.head()["rate"].is_null());
  EXPECT_TRUE(none.head()["interval"].is_null());
}

TEST(RunBlock, EpisodesAndLines) {
  episode_summary_t summary{};
  summary.header.episode = 7;
  summary.seed = int64_t{1} << 52;
  summary.failure_reason = "dropped";
  summary.metrics.completion_time_s = 2.5;
  summary.explanation.text = "dropped <i>it</i>";
  const BlockReader episodes(EpisodesBlock(1, 7, {RowOf(summary, "lift_pot", "base")}));
  EXPECT_EQ(episodes.head()["from"], 7);
  const auto& row = episodes.head()["episodes"][0];
  EXPECT_EQ(row["seed"], int64_t{1} << 52);
  EXPECT_EQ(row["time_s"], 2.5);
  EXPECT_EQ(row["text"], "dropped <i>it</i>");
  EXPECT_TRUE(row["video"].is_null());
  // A source may lack the data that a count requires.
  summary.metrics.slip_count = summary.metrics.env_collision_count = kUnavailableCount;
  summary.metrics.self_collision_count = 2;
  EXPECT_FALSE(RowOf(summary, "lift_pot", "base").slips.has_value());
  EXPECT_EQ(RowOf(summary, "lift_pot", "base").collisions, 2);
  summary.metrics.stage_reached = {1, 0};
  EXPECT_EQ(RowOf(summary, "lift_pot", "base").stages, 1);
  const BlockReader unavailable(EpisodesBlock(1, 7, {RowOf(summary, "lift_pot", "base")}));
  EXPECT_TRUE(unavailable.head()["episodes"][0]["slips"].is_null());
  EXPECT_EQ(unavailable.head()["episodes"][0]["collisions"], 2);

  log_t line{};
  line.header.episode = 3;
  line.header.tick = -1;
  line.component = "policy";
  line.level = log_t::WARN_LEVEL;
  line.text = "slow\n";
  const BlockReader log(LogBlock(0, {{line, "14:03:07"}}));
  EXPECT_EQ(log.head()["lines"][0]["level"], "warn");
  EXPECT_EQ(log.head()["lines"][0]["episode"], 3);
  EXPECT_TRUE(log.head()["lines"][0]["tick"].is_null());
  EXPECT_EQ(log.head()["lines"][0]["text"], "slow?");
  EXPECT_EQ(log.head()["lines"][0]["time"], "14:03:07");
}

}  // namespace evalbus::viz::run_block_test
