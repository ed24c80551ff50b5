#include "policy_bridge/actions/chunk_schedule.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "base/errors.h"

namespace evalbus::policy::chunk_schedule_test {

// Plays ticks from 0 with inferences that take `delay` ticks and return `rows` rows. For each tick, the text
// has the chunk's letter and the row ("a0"), or "--" where the robot holds. '*' marks a tick at which an
// inference begins.
std::string Play(Execution rule, int execute_steps, int rows, int delay, int ticks) {
  ChunkSchedule schedule(rule, execute_steps);
  std::string text;
  for (int tick = 0; tick < ticks; ++tick) {
    const bool is_due = schedule.IsDue(tick);
    if (is_due) {
      schedule.Ask(tick);
      schedule.Arrive(tick + delay, rows);
    }
    const auto step = schedule.At(tick);
    if (tick > 0) text += ' ';
    if (is_due) text += '*';
    text += step ? std::string(1, static_cast<char>('a' + step->chunk)) + std::to_string(step->row) : "--";
  }
  return text;
}

TEST(ChunkSchedule, WithoutDelayAllRulesAreTheSame) {
  for (const Execution rule :
       {Execution::kSynchronous, Execution::kAsynchronous, Execution::kRealTimeChunking}) {
    EXPECT_EQ(Play(rule, 2, 4, 0, 5), "*a0 a1 *b0 b1 *c0");
  }
}

TEST(ChunkSchedule, SynchronousHoldsDuringEachInference) {
  EXPECT_EQ(Play(Execution::kSynchronous, 2, 4, 3, 12), "*-- -- -- a0 a1 *-- -- -- b0 b1 *-- --");
}

TEST(ChunkSchedule, AsynchronousGoesOnAndSkipsTheRowsThatPassed) {
  // Row 0 of chunk a belongs to tick 2, at which it arrives. Chunk b observes tick 5, after 3 rows. It
  // arrives at tick 7, to which its row 2 belongs.
  EXPECT_EQ(Play(Execution::kAsynchronous, 3, 6, 2, 13), "*-- -- a0 a1 a2 *a3 a4 b2 *b3 b4 c2 *c3 c4");
}

TEST(ChunkSchedule, AsynchronousAsksEarlyEnough) {
  // All 4 rows may be executed, so the inference begins 2 ticks before they are used up.
  EXPECT_EQ(Play(Execution::kAsynchronous, 4, 4, 2, 9), "*-- -- a0 a1 *a2 a3 *b2 b3 *c2");
}

TEST(ChunkSchedule, AsynchronousHoldsWhereAnInferenceTakesLongerThanAChunk) {
  EXPECT_EQ(Play(Execution::kAsynchronous, 2, 2, 4, 11), "*-- -- -- -- a0 *a1 -- -- -- *b1 --");
  // A chunk of one action is executed when it arrives, however old it is.
  EXPECT_EQ(Play(Execution::kAsynchronous, 1, 1, 2, 9), "*-- -- a0 *-- -- *b0 -- *c0 --");
}

TEST(ChunkSchedule, ANewEpisodeForgetsTheOldOne) {
  ChunkSchedule schedule(Execution::kSynchronous, 2);
  schedule.Ask(0);
  schedule.Begin();
  EXPECT_TRUE(schedule.IsDue(0));
  EXPECT_FALSE(schedule.At(0));
}

TEST(ChunkSchedule, KnowsWhatIsCommittedAndHowOldAnActionIs) {
  ChunkSchedule schedule(Execution::kRealTimeChunking, 3);
  EXPECT_EQ(schedule.RestAt(0).count, 0);
  schedule.Ask(0);
  schedule.Arrive(1, 8);
  EXPECT_EQ(schedule.overlap().rows, 0) << "there is no chunk before the first";
  // Rows 0, 1 and 2 were executed at ticks 1, 2 and 3.
  EXPECT_TRUE(schedule.IsDue(4));
  EXPECT_EQ(schedule.RestAt(4).first, 3);
  EXPECT_EQ(schedule.RestAt(4).count, 5);
  schedule.Ask(4);
  EXPECT_FALSE(schedule.IsDue(5));
  schedule.Arrive(6, 8);
  EXPECT_EQ(schedule.overlap().delay, 2);
  EXPECT_EQ(schedule.overlap().rows, 5);
  EXPECT_EQ(schedule.overlap().offset, 3);
  ASSERT_TRUE(schedule.At(5));
  EXPECT_EQ(schedule.observed_tick(), 0);
  ASSERT_TRUE(schedule.At(6));
  EXPECT_EQ(schedule.observed_tick(), 4);
}

// The numbers follow from equation 5 of arXiv 2506.07339 with d = 1 and H - s = 3, so c = 2/3 and 1/3.
TEST(OlderWeight, DecreasesFromCommittedToFree) {
  EXPECT_EQ(OlderWeight(0, 1, 3), 1);
  EXPECT_NEAR(OlderWeight(1, 1, 3), 2.0 / 3 * (std::exp(2.0 / 3) - 1) / (std::exp(1) - 1), 1e-15);
  EXPECT_NEAR(OlderWeight(1, 1, 3), 0.367706, 1e-6);
  EXPECT_NEAR(OlderWeight(2, 1, 3), 0.076746, 1e-6);
  EXPECT_EQ(OlderWeight(3, 1, 3), 0);
  EXPECT_EQ(OlderWeight(5, 7, 3), 0) << "the last chunk ended before the new one arrived";
}

TEST(JoinRows, AveragesRowsOfTheSameTick) {
  const std::vector<std::vector<double>> last = {{9}, {9}, {1}, {1}, {1}};
  std::vector<std::vector<double>> rows = {{0}, {0}, {0}, {0}};
  JoinRows(last, {.delay = 1, .rows = 3, .offset = 2}, &rows);
  EXPECT_EQ(rows[0][0], 1);
  EXPECT_NEAR(rows[1][0], 0.367706, 1e-6);
  EXPECT_NEAR(rows[2][0], 0.076746, 1e-6);
  EXPECT_EQ(rows[3][0], 0);
}

TEST(Execution, IsOneOfThree) {
  EXPECT_EQ(ParseExecution("synchronous"), Execution::kSynchronous);
  EXPECT_EQ(ParseExecution("asynchronous"), Execution::kAsynchronous);
  EXPECT_EQ(ParseExecution("rtc"), Execution::kRealTimeChunking);
  EXPECT_THROW(ParseExecution("async"), InputError);
}

}  // namespace evalbus::policy::chunk_schedule_test
