#include "results/policy_calls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "base/run_layout.h"
#include "results/run_reader.h"
#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::policy_calls_test {

using nlohmann::ordered_json;
using testing::ElementsAre;
using testing::EndsWith;
using testing::IsEmpty;

policy_action_t Call(int64_t tick, double answered_s, double server_s, int held_ticks = 0) {
  policy_action_t call{};
  call.header.tick = tick;
  call.num_steps = 10;
  call.answered_s = answered_s;
  call.server_s = server_s;
  call.held_ticks = held_ticks;
  return call;
}

TEST(PolicyCalls, TheCallAboutTheLastTickIsNotCounted) {
  PolicyCalls calls;
  calls.Add(Call(0, 0.5, -1));
  calls.Add(Call(10, 0.25, 0.125, 2));
  calls.Add(Call(20, 1, -1, 1));
  const CallSchedule schedule{.execute_steps = 10, .settle_steps = 0};
  EXPECT_EQ(calls.Json(schedule, 20)["tick"].dump(), "[0,10,20]");
  calls.RemoveUndecided(20);
  // The command is held at ticks 10 and 11, before the second answer. The actions of ticks 0 to 9 are 0 to 9
  // ticks old, and those of ticks 12 to 19 are 2 to 9 ticks old: 45 + 44.
  EXPECT_EQ(calls.Json(schedule, 20).dump(),
            R"({"tick":[0,10],"answered_s":[0.5,0.25],"server_s":[-1.0,0.125],"held_ticks":2,)"
            R"("ticks":20,"age_ticks":89,"due_calls":2})");
}

TEST(PolicyCalls, AsynchronousActionsAreOlderAndFewTicksAreHeld) {
  PolicyCalls calls;
  calls.Add(Call(0, 0, -1, 2));
  calls.Add(Call(5, 0, -1, 2));
  CallSchedule schedule{.execute_steps = 3, .execution = policy::Execution::kAsynchronous, .chunk_steps = 6};
  // The command is held at ticks 0 and 1. Ticks 2 to 6 execute the first chunk, from tick 0. Ticks 7 and 8
  // execute the second, from tick 5. Ages: 2 + 3 + 4 + 5 + 6 + 2 + 3.
  const ordered_json json = calls.Json(schedule, 9);
  EXPECT_EQ(json["held_ticks"], 2);
  EXPECT_EQ(json["age_ticks"], 25);
  // The second chunk, from tick 5, has rows for ticks 5 to 10. Without chunk_steps, it has 10 rows.
  EXPECT_EQ(calls.Json(schedule, 12)["held_ticks"], 3);
  schedule.chunk_steps = 0;
  EXPECT_EQ(calls.Json(schedule, 12)["held_ticks"], 2);
}

TEST(PolicyCalls, ALostCallIsNoticedAndARepeatedOneIgnored) {
  const CallSchedule schedule{.execute_steps = 10, .settle_steps = 5};
  PolicyCalls calls;
  EXPECT_FALSE(calls.IsWhole(schedule, 6));
  EXPECT_TRUE(calls.IsWhole(schedule, 5));
  calls.Add(Call(5, 0.5, -1, 2));
  calls.Add(Call(5, 0.5, -1, 2));
  // Ticks 7 to 16 execute the first answer, so the next call is due at tick 17.
  EXPECT_TRUE(calls.IsWhole(schedule, 17));
  EXPECT_FALSE(calls.IsWhole(schedule, 18));
  calls.Add(Call(17, 0.25, -1));
  EXPECT_TRUE(calls.IsWhole(schedule, 27));
  EXPECT_EQ(calls.Json(schedule, 27)["tick"].dump(), "[5,17]");
  PolicyCalls late;
  late.Add(Call(17, 0.25, -1));
  EXPECT_FALSE(late.IsWhole(schedule, 27));
  // In asynchronous execution, the first chunk begins at tick 2. The next call is due after three of its
  // rows, at tick 5.
  const CallSchedule asynchronous{
      .execute_steps = 3, .execution = policy::Execution::kAsynchronous, .chunk_steps = 6};
  PolicyCalls chunks;
  chunks.Add(Call(0, 0, -1, 2));
  EXPECT_TRUE(chunks.IsWhole(asynchronous, 5));
  EXPECT_FALSE(chunks.IsWhole(asynchronous, 6));
  chunks.Add(Call(5, 0, -1, 2));
  EXPECT_TRUE(chunks.IsWhole(asynchronous, 8));
}

// An episode with ticks of 20 ms that ended at last_tick. Its values cover the ticks until completion_time_s.
episode_summary_t Summary(int64_t last_tick, double completion_time_s) {
  episode_summary_t summary{};
  summary.header.tick = last_tick;
  summary.header.sim_time_us = last_tick * 20000;
  summary.metrics.completion_time_s = completion_time_s;
  return summary;
}

TEST(DelayMetrics, AreThoseOfTheTicksThatTheValuesCover) {
  PolicyCalls calls;
  calls.Add(Call(0, 0.5, -1));
  calls.Add(Call(10, 0.25, 0.125, 2));
  // The success was at tick 20, and the episode continued for 10 ticks.
  const episode_summary_t summary = Summary(30, 0.4);
  EXPECT_EQ(ScoredTicks(summary), 20);
  ordered_json line = EpisodeLine(0, true);
  EXPECT_FALSE(HasDelayMetrics(line));
  AddDelayMetrics(calls.Json({.execute_steps = 10}, ScoredTicks(summary)), summary, &line);
  EXPECT_TRUE(HasDelayMetrics(line));
  // The command was held at 2 of 20 ticks. 18 actions were executed in 0.4 s; their ages sum to 89 ticks, as
  // above.
  EXPECT_DOUBLE_EQ(line["extended"]["stale_action_ratio"], 0.1);
  EXPECT_DOUBLE_EQ(line["extended"]["effective_hz"], 45);
  EXPECT_DOUBLE_EQ(line["extended"]["action_age_s"], 89 * 0.02 / 18);
}

TEST(DelayMetrics, AreNullWithoutTicksOrActions) {
  ordered_json line = EpisodeLine(0, false);
  AddDelayMetrics(PolicyCalls().Json({}, 0), Summary(0, 0), &line);
  EXPECT_TRUE(HasDelayMetrics(line));
  for (const char* name : {"stale_action_ratio", "effective_hz", "action_age_s"})
    EXPECT_TRUE(line["extended"][name].is_null()) << name;
  AddDelayMetrics(PolicyCalls().Json({}, 10), Summary(10, 0.2), &line);
  EXPECT_EQ(line["extended"]["stale_action_ratio"], 1);
  EXPECT_EQ(line["extended"]["effective_hz"], 0);
  EXPECT_TRUE(line["extended"]["action_age_s"].is_null());
}

class PolicyNotesTest : public testing::Test {
 protected:
  RecordedRun Run(const ordered_json& more, bool delay = false) {
    ordered_json info = RunInfo(2);
    info.update(more);
    ordered_json first = EpisodeLine(0, true), second = EpisodeLine(1, false);
    if (delay) {
      first["extended"].update({{"stale_action_ratio", 0}, {"effective_hz", 50}, {"action_age_s", 0.15}});
      second["extended"].update({{"stale_action_ratio", 0.2}, {"effective_hz", 40}, {"action_age_s", 0.05}});
    }
    WriteRun(folder_.path() / "run", info, {first, second});
    return ReadRun(folder_.path() / "run");
  }
  static ordered_json Contract() {
    return {{"name", "mine"},
            {"wire", "openpi"},
            {"rate_hz", 20.0},
            {"privileged", false},
            {"action", {{"kind", "joint_delta"}, {"execute_steps", 10}}}};
  }
  TemporaryFolder folder_;
};

TEST_F(PolicyNotesTest, OfAPolicyWithoutAServerThereAreNone) {
  EXPECT_THAT(PolicyNotes(Run(ordered_json::object())), IsEmpty());
  EXPECT_THAT(PolicyNotes(Run({{"policy_contract", nullptr}})), IsEmpty());
}

TEST_F(PolicyNotesTest, ReportsTheCostOfComputation) {
  EXPECT_THAT(
      PolicyNotes(Run({{"policy_contract", Contract()}, {"latency", "none"}})),
      ElementsAre("Policy behind a server, contract mine (openpi): joint_delta, 10 steps of each answer "
                  "executed at 20 Hz; simulated time was paused during the policy's computation."));
  EXPECT_THAT(
      PolicyNotes(Run({{"policy_contract", Contract()}, {"latency", "120"}})),
      ElementsAre(EndsWith("each call took 120 ms of simulated time, rounded up to 6 ticks = 120 ms.")));
  EXPECT_THAT(
      PolicyNotes(Run({{"policy_contract", Contract()}, {"latency", "120"}, {"control_hz", 20.0}})),
      ElementsAre(EndsWith("each call took 120 ms of simulated time, rounded up to 3 ticks = 150 ms.")));
  EXPECT_THAT(PolicyNotes(Run({{"policy_contract", Contract()}, {"latency", "1"}, {"control_hz", 20.0}})),
              ElementsAre(EndsWith("each call took 1 ms of simulated time, rounded up to 1 tick = 50 ms.")));
  EXPECT_THAT(PolicyNotes(Run({{"policy_contract", Contract()}, {"latency", "measured"}})),
              ElementsAre(EndsWith("as measured, rounded up to whole ticks.")));
  EXPECT_THAT(PolicyNotes(Run({{"policy_contract", Contract()}, {"latency", "none"}, {"realtime", true}})),
              ElementsAre(EndsWith("simulated time continued during the policy's computation (real time).")));
}

TEST_F(PolicyNotesTest, PoolsTheCallsOfAllEpisodes) {
  ordered_json contract = Contract();
  contract["privileged"] = true;
  const RecordedRun run = Run({{"policy_contract", contract}, {"latency", "none"}}, true);
  PolicyCalls first, second;
  first.Add(Call(0, 1.5, 0.004));
  first.Add(Call(10, 0.010, -1));
  second.Add(Call(0, 0.020, 0.002, 3));
  const auto write = [&](int episode, const PolicyCalls& calls, int64_t ticks) {
    const auto file = EpisodeFolder(run.folder, episode) / kPolicyCallsJson;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << calls.Json({.execute_steps = 10}, ticks);
  };
  write(0, first, 17);
  write(1, second, 13);
  const auto notes = PolicyNotes(run);
  ASSERT_EQ(notes.size(), 4u);
  EXPECT_EQ(notes[1], "The policy received poses of objects, which a real robot cannot measure.");
  EXPECT_EQ(notes[2],
            "Its server was called 3 times: 20 ms median, 1.5 s 99th percentile, 1.5 s longest; 2 ms median "
            "as reported by the server; the robot held its last command for 3 ticks.");
  // These numbers are means of the episodes' metrics.
  EXPECT_EQ(notes[3],
            "45.0 new actions per second; 10.0 % of the ticks had none and held the last command; an action "
            "was 100 ms old on average.");
}

// On a real-time clock the policy was called only twice; the answer for tick 0 was executed at tick 8.
TEST_F(PolicyNotesTest, WarnsOfAPolicyThatWasHardlyCalled) {
  const RecordedRun run = Run({{"policy_contract", Contract()}, {"realtime", true}});
  PolicyCalls calls;
  calls.Add(Call(0, 0.1, -1, 8));
  calls.Add(Call(395, 0.1, -1, 1));
  const ordered_json episode = calls.Json({.execute_steps = 1, .settle_steps = 10}, 410);
  EXPECT_EQ(episode["ticks"], 400);
  EXPECT_EQ(episode["due_calls"], 400);
  EXPECT_EQ(episode["held_ticks"], 398);
  const auto file = EpisodeFolder(run.folder, 0) / kPolicyCallsJson;
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file) << episode;
  EXPECT_EQ(
      PolicyNotes(run).at(0),
      "warning: the policy was called 2 times in 400 ticks instead of 400 times: the robot held its last "
      "command for 398 of the ticks, so the scores hardly depend on the policy.");
  // The policy was never called.
  EXPECT_NE(RareCallsWarning({PolicyCalls().Json({.execute_steps = 3}, 5)}), "");
}

TEST(PolicyCalls, HalfOfTheDueCallsAreEnough) {
  PolicyCalls calls;
  for (const int64_t tick : {0, 6, 12}) calls.Add(Call(tick, 0.1, -1, 3));
  // 3 of 6 due calls were made, and the command was held for 3 ticks after each.
  const ordered_json episode = calls.Json({.execute_steps = 3}, 18);
  EXPECT_EQ(episode["due_calls"], 6);
  EXPECT_EQ(episode["held_ticks"], 9);
  EXPECT_EQ(RareCallsWarning({episode}), "");
  // An answer for the last tick is never executed. In an episode without ticks no call is due.
  PolicyCalls last;
  last.Add(Call(0, 0.1, -1));
  EXPECT_EQ(last.Json({.execute_steps = 3}, 0)["held_ticks"], 0);
  EXPECT_EQ(RareCallsWarning({last.Json({}, 0)}), "");
}

}  // namespace evalbus::results::policy_calls_test
