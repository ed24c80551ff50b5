#include "metrics/episode/episode_scorer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "bus/message.h"
#include "lcmtypes/extended_value.h"
#include "metrics/episode/result_json.h"
#include "models/robot_description.h"
#include "models/scene.h"
#include "tests/unit/allocation_count.h"
#include "tests/unit/small_world.h"

namespace evalbus::metrics::episode_scorer_test {

using namespace small_world;

class EpisodeScorerTest : public testing::Test {
 protected:
  episode_summary_t Summary(const std::string& end_reason, int64_t last_tick) {
    dut_.EndAt(last_tick);
    episode_begin_t begin{};
    begin.seed = 77;
    episode_end_t end{};
    end.header = Header(last_tick);
    end.header.attempt = 2;
    end.end_reason = end_reason;
    end.detail = "detail";
    return dut_.Summary(begin, end);
  }
  EpisodeScorer dut_{Model(), ParseTask(kTask, "small.yaml", false)};
};

TEST_F(EpisodeScorerTest, ScoresAnEpisodeByHand) {
  dut_.Start();
  dut_.Tick(State(0), Contacts(0));
  dut_.Tick(State(1), Contacts(1, {{kLeftPad, kWall}, {kLeftLink, kTop}, {kTop, kWall}}));
  dut_.Tick(State(2), Contacts(2, {{kLeftLink, kRightLink}, {kTop, kWall}}));  // released: a slip
  partial_metrics_t partial{};
  dut_.Partial(&partial);
  EXPECT_EQ(partial.header.tick, 2);
  EXPECT_EQ(partial.verdict, partial_metrics_t::UNDECIDED);
  EXPECT_EQ(partial.metrics.slip_count, 1);
  EXPECT_EQ(partial.metrics.env_collision_count, 1);
  EXPECT_EQ(partial.metrics.self_collision_count, 1);
  EXPECT_EQ(partial.metrics.subtask_progress, 0.5);
  EXPECT_EQ(partial.metrics.completion_time_s, 0.04);

  state_t lifted = State(3);
  lifted.body[kPot].position_m[2] = 1.25;
  lifted.arm[1].wrist_position_m[2] = 2;
  lifted.action_clips = 4;
  lifted.deadline_misses = 5;
  lifted.arm[1].mechanical_work_J = 2.5;
  contacts_t contacts = Contacts(3, {});
  contacts.has_clearance = true;
  contacts.clearance_m = 0.1;
  dut_.Tick(lifted, contacts);
  const episode_summary_t summary = Summary("success", 3);
  EXPECT_EQ(summary.header.tick, 3);
  EXPECT_EQ(summary.seed, 77);
  EXPECT_EQ(summary.header.attempt, 2);
  EXPECT_EQ(summary.verdict, partial_metrics_t::SUCCESS);
  EXPECT_EQ(summary.end_reason, "success");
  EXPECT_EQ(summary.end_detail, "detail");
  EXPECT_EQ(summary.failure_reason, "");
  EXPECT_TRUE(summary.complete);
  // The poses are those at the tick of the success.
  EXPECT_EQ(PosesOf(summary), (NamedPoses{{"left_wrist", {{0.7, 0, 1.5}, {1, 0, 0, 0}}},
                                          {"right_wrist", {{0.7, 0, 2}, {1, 0, 0, 0}}},
                                          {"pot", {{0.7, 0, 1.25}, {1, 0, 0, 0}}}}));
  const auto result = ResultJson(summary.metrics);
  EXPECT_EQ(result["success"], 1.0);
  EXPECT_EQ(result["task_stage_reached"].dump(), R"({"1":true,"2":true})");
  EXPECT_EQ(result["target_distance"].dump(), R"({"lift":0.25,"left_gripper_to_pot":0.25})");
  EXPECT_EQ(result["object_pose_error"], 0.0);
  EXPECT_DOUBLE_EQ(result["cartesian_path_length"]["right"], 0.5);
  EXPECT_EQ(summary.extended.stage_time_s, (std::vector<double>{0.02, 0.06}));
  EXPECT_EQ(summary.extended.action_clips, 4);
  EXPECT_EQ(summary.extended.deadline_misses, 5);
  EXPECT_EQ(ExtendedValue(summary.extended, "min_clearance_m"), 0.1);
  EXPECT_DOUBLE_EQ(ExtendedValue(summary.extended, "peak_wrist_speed_mps.right"), 25);
  EXPECT_DOUBLE_EQ(ExtendedValue(summary.extended, "contact_time_s"), 0.02);
  EXPECT_EQ(ExtendedValue(summary.extended, "mechanical_work_J.left"), 0);
  EXPECT_EQ(ExtendedValue(summary.extended, "mechanical_work_J.right"), 2.5);
}

// Every time is the double nearest to 4.6, whereas the product 0.02 * 230 is 4.6000000000000005.
TEST_F(EpisodeScorerTest, ATickHasOneTimeEverywhere) {
  dut_.Start();
  for (int64_t tick = 0; tick <= 230; ++tick) {
    const bool is_last = tick == 230;
    contacts_t contacts = Contacts(tick, {{kTop, kWall}});
    if (tick >= 229) contacts = Contacts(tick, {{kLeftPad, kWall}, {kTop, kWall}});
    if (is_last) contacts = Contacts(tick, {{kLeftLink, kTop}, {kTop, kWall}});
    contacts.has_clearance = is_last;
    dut_.Tick(State(tick), contacts);
  }
  const episode_summary_t summary = Summary("time_limit", 230);
  EXPECT_EQ(summary.metrics.completion_time_s, 4.6);
  EXPECT_EQ(summary.explanation.first_collision_time_s, 4.6);
  ASSERT_EQ(summary.explanation.slip.size(), 1u);
  EXPECT_EQ(summary.explanation.slip[0].time_s, 4.6);
  EXPECT_EQ(summary.explanation.condition.at(0).time_s, 4.6);
  EXPECT_EQ(ExtendedValue(summary.extended, "min_clearance_time_s"), 4.6);
}

TEST_F(EpisodeScorerTest, AHeldObjectOfTheResetStateCanSlipAtOnce) {
  dut_.Start();
  dut_.Tick(State(0), Contacts(0, {{kLeftPad, kWall}}));
  dut_.Tick(State(1), Contacts(1));
  EXPECT_EQ(Summary("time_limit", 1).metrics.slip_count, 1);
}

TEST_F(EpisodeScorerTest, AGapMakesTheEpisodeIncomplete) {
  for (const auto& [ticks, last, missing] : std::vector<std::tuple<std::vector<int64_t>, int64_t, int64_t>>{
           {{0, 1, 2}, 2, 0}, {{0, 2}, 2, 1}, {{1, 2}, 2, 1}, {{0, 1}, 4, 3}, {{}, 2, 3}}) {
    dut_.Start();
    for (int64_t tick : ticks) dut_.Tick(State(tick), Contacts(tick));
    const episode_summary_t summary = Summary("time_limit", last);
    EXPECT_EQ(summary.extended.missing_ticks, missing);
    EXPECT_EQ(summary.complete, missing == 0);
    EXPECT_EQ(summary.failure_reason, "timeout");
  }
}

TEST_F(EpisodeScorerTest, RefusesWhatIsNotFiniteOrDoesNotFit) {
  const double kNaN = std::numeric_limits<double>::quiet_NaN();
  const std::function<void(state_t*)> faults[] = {
      [&](state_t* s) { s->body[kPot].position_m[1] = kNaN; },
      [&](state_t* s) { s->body[kPot].quat_wxyz[1] = 1 / 0.; },
      [&](state_t* s) { s->arm[1].joint_position_rad[0] = kNaN; },
      [&](state_t* s) {
        s->qpos_mixed = {0, kNaN};
        s->num_qpos = 2;
      },
      [&](state_t* s) {
        s->num_bodies = 1;
        s->body.resize(1);
      },
      [&](state_t* s) {
        s->num_arms = 1;
        s->arm.resize(1);
      },
      [&](state_t* s) {
        s->num_grippers = 0;
        s->gripper.clear();
      },
  };
  for (const auto& fault : faults) {
    dut_.Start();
    dut_.Tick(State(0), Contacts(0));
    state_t state = State(1);
    state.body[kPot].position_m[2] = 2;
    fault(&state);
    dut_.Tick(state, Contacts(1, {}));
    const episode_summary_t summary = Summary("time_limit", 1);
    EXPECT_EQ(summary.extended.refused_samples, 1);
    EXPECT_EQ(summary.extended.missing_ticks, 0);
    EXPECT_FALSE(summary.complete);
    EXPECT_EQ(summary.verdict, partial_metrics_t::UNDECIDED) << "a refused tick is not judged";
  }
}

// NaN is in no range, so "not" of a range would be true for it.
TEST(EpisodeScorer, ACoordinateThatIsNoNumberDecidesNothing) {
  model_info_t model = Model();
  model.joint_name = {"pot/lid_hinge"};
  model.joint_qpos_index = {0};
  model.joint_lower_mixed = {0};
  model.joint_upper_mixed = {1};
  model.num_joints = 1;
  std::string text = kTask;
  const size_t begin = text.find("success:"), end = text.find("failure:");
  text.replace(begin, end - begin, "success: {not: {joint_fraction: {joint: pot/lid_hinge, max: 0.9}}}\n");
  EpisodeScorer dut(model, ParseTask(text, "t.yaml", false));
  state_t state = State(0);
  state.qpos_mixed = {0.5};
  state.num_qpos = 1;
  dut.Tick(state, Contacts(0));
  state.header = Header(1);
  state.qpos_mixed = {std::numeric_limits<double>::quiet_NaN()};
  dut.Tick(state, Contacts(1));
  EXPECT_EQ(dut.verdict(), partial_metrics_t::UNDECIDED);
  EXPECT_EQ(dut.refused_samples(), 1);
  state.header = Header(2);
  state.qpos_mixed = {0.95};
  dut.Tick(state, Contacts(2));
  EXPECT_EQ(dut.verdict(), partial_metrics_t::SUCCESS);
}

// Statistics must be the same from the summary message and from its line of episodes.jsonl.
TEST_F(EpisodeScorerTest, MessageAndJsonGiveOneResult) {
  dut_.Start();
  dut_.Tick(State(0), Contacts(0, {{kLeftPad, kWall}}));
  dut_.Tick(State(1), Contacts(1, {{kLeftLink, kTop}, {kLeftLink, kRightLink}}));
  const episode_summary_t summary = Summary("time_limit", 1);
  const EpisodeResult a = ResultOf({}, summary);
  const EpisodeResult b = ResultOf({{"complete", true},
                                    {"end_reason", "time_limit"},
                                    {"failure_reason", summary.failure_reason},
                                    {"metrics", ResultJson(summary.metrics)},
                                    {"extended", ExtendedJson(summary.extended, summary.metrics)},
                                    {"explanation", ExplanationJson(summary.explanation)}});
  EXPECT_EQ(a.complete, b.complete);
  EXPECT_EQ(a.success, b.success);
  EXPECT_EQ(a.failure_reason, b.failure_reason);
  EXPECT_EQ(a.values, b.values);
  EXPECT_EQ(a.stages, b.stages);
  EXPECT_EQ(a.slips, b.slips);
  EXPECT_EQ(a.collisions, b.collisions);
  EXPECT_GT(a.values.size(), 20u);
  EXPECT_EQ(a.slips, (std::vector<int64_t>{1}));
  EXPECT_EQ(a.collisions.size(), 2u);
  EXPECT_EQ(a.stages.size(), 2u);
}

TEST_F(EpisodeScorerTest, DoesNotAllocateAfterTheFirstEpisode) {
  partial_metrics_t partial{};
  const contacts_t contacts = Contacts(1, {{kLeftPad, kWall}, {kLeftLink, kTop}, {kLeftLink, kRightLink}});
  std::vector<state_t> states;
  for (int64_t tick = 0; tick < 30; ++tick) states.push_back(State(tick));
  for (int episode = 0; episode < 2; ++episode) {
    const int64_t before = AllocationCount();
    dut_.Start();
    for (const state_t& state : states) {
      dut_.Tick(state, contacts);
      dut_.Partial(&partial);
    }
    if (episode == 1) {
      EXPECT_EQ(AllocationCount() - before, 0);
    }
  }
}

TEST_F(EpisodeScorerTest, CutShortIsNotComplete) {
  for (const auto& [end_reason, complete] :
       {std::pair("time_limit", true), std::pair("policy_error", true), std::pair("aborted", false),
        std::pair("server_error", false), std::pair("success", false), std::pair("failure", false)}) {
    dut_.Start();
    dut_.Tick(State(0), Contacts(0));
    dut_.Tick(State(1), Contacts(1));
    EXPECT_EQ(Summary(end_reason, 1).complete != 0, complete) << end_reason;
  }
}

TEST_F(EpisodeScorerTest, AServersFaultIsNoFailureOfThePolicy) {
  for (const bool succeeds : {false, true}) {
    dut_.Start();
    dut_.Tick(State(0), Contacts(0));
    state_t state = State(1);
    if (succeeds) state.body[kPot].position_m[2] = 1.25;
    dut_.Tick(state, Contacts(1, {}));
    const episode_summary_t summary = Summary("server_error", 1);
    EXPECT_FALSE(summary.complete);
    EXPECT_EQ(summary.failure_reason, "server_error");
    const std::string start =
        "server error at 0.02 s (invalid: the policy's server failed, so there is no result for the "
        "policy): ";
    EXPECT_TRUE(summary.explanation.text.starts_with(start)) << summary.explanation.text;
    const EpisodeResult result = ResultOf({}, summary);
    EXPECT_TRUE(result.invalid);
    RunStatistics statistics;
    statistics.Add(0, result);
    EXPECT_EQ(statistics.Summary(false).invalid, 1);
    EXPECT_EQ(statistics.Summary(false).complete, 0);
  }
}

// The episode continues for 0.1 s, which are five ticks, after its first success.
class AfterSuccess : public testing::Test {
 protected:
  static model_info_t ModelOf(int64_t after_success_us) {
    model_info_t model = Model();
    model.after_success_us = after_success_us;
    return model;
  }
  // Plays ticks, starting with tick 0. The flags state whether the pot is lifted. The wrists move at each
  // tick. At odd ticks, a pad touches the pot and a link touches the counter.
  static episode_summary_t Play(EpisodeScorer* dut, const std::vector<bool>& up,
                                const std::string& end = "success") {
    dut->Start();
    for (size_t i = 0; i < up.size(); ++i) {
      const auto tick = static_cast<int64_t>(i);
      state_t state = State(tick);
      state.body[kPot].position_m[2] = up[i] ? 1.25 : 1;
      for (arm_state_t& arm : state.arm) {
        arm.wrist_position_m[0] = 0.01 * static_cast<double>(i * i);
        arm.mechanical_work_J = static_cast<double>(i);
      }
      state.action_clips = state.unreachable_poses = state.singular_poses = state.deadline_misses = tick;
      const bool odd = i % 2 == 1;
      std::vector<std::pair<int, int>> contacts;
      if (!up[i]) contacts.push_back({kTop, kWall});
      if (odd) contacts.insert(contacts.end(), {{kLeftLink, kTop}, {kLeftPad, kWall}});
      dut->Tick(state, Contacts(tick, contacts));
    }
    episode_begin_t begin{};
    episode_end_t message{};
    message.header = Header(static_cast<int64_t>(up.size()) - 1);
    message.end_reason = end;
    return dut->Summary(begin, message);
  }
  static double Value(const episode_summary_t& summary, const std::string& name) {
    return ExtendedValue(summary.extended, name);
  }
  const TaskDescription task_ = ParseTask(kTask, "small.yaml", false);
  EpisodeScorer dut_{ModelOf(100'000), task_};
};

TEST_F(AfterSuccess, ReportsHowLongSuccessHeldAndWhetherItDoesAtTheEnd) {
  struct Case {
    std::vector<bool> up;
    double once, end, held;
  };
  const double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const Case& c : {Case{{false, false, true, true, true, true, true, true}, 1, 1, 0.1},
                        Case{{false, false, true, false, true, true, false, false}, 1, 0, 0.04},
                        Case{{false, false, true, false, false, false, false, true}, 1, 1, 0.02},
                        Case{{false, false, true, false, false, false, false, false}, 1, 0, 0},
                        // The policy failed, so no tick followed the success.
                        Case{{false, false, true}, 1, 1, 0},
                        // A real-time episode may have more ticks than requested.
                        Case{{false, false, true, true, true, true, true, true, false, false}, 1, 1, 0.1},
                        Case{{false, false, false}, 0, 0, kNaN}}) {
    const episode_summary_t summary = Play(&dut_, c.up, c.once == 1 ? "success" : "time_limit");
    const std::string shown = testing::PrintToString(c.up);
    EXPECT_EQ(summary.verdict, c.once == 1 ? partial_metrics_t::SUCCESS : partial_metrics_t::UNDECIDED)
        << shown;
    EXPECT_TRUE(summary.complete) << shown;
    EXPECT_EQ(summary.metrics.completion_time_s, 0.04) << shown;
    EXPECT_EQ(Value(summary, "success_once"), c.once) << shown;
    EXPECT_EQ(Value(summary, "success_end"), c.end) << shown;
    if (std::isnan(c.held)) {
      EXPECT_TRUE(std::isnan(Value(summary, "success_held_s"))) << shown;
      EXPECT_TRUE(ExtendedJson(summary.extended, summary.metrics)["success_held_s"].is_null());
    } else {
      EXPECT_EQ(Value(summary, "success_held_s"), c.held) << shown;
    }
  }
}

TEST_F(AfterSuccess, AFailureThatComesLaterIsNoVerdictAndNoSuccessAtTheEnd) {
  dut_.Start();
  for (int64_t tick = 0; tick <= 3; ++tick) {
    state_t state = State(tick);
    state.body[kPot].position_m[2] = tick > 0 ? 1.25 : 1;
    // The pot is lifted at tick 1, stays lifted, and touches the floor at tick 2. At tick 3 a hand is far
    // away.
    if (tick == 3) state.body[kLeftHand].position_m[0] = 11;
    dut_.Tick(state, tick == 2 ? Contacts(tick, {{kFloor, kWall}}) : Contacts(tick, {}));
    partial_metrics_t partial{};
    dut_.Partial(&partial);
    EXPECT_EQ(partial.header.tick, tick);
    EXPECT_EQ(partial.verdict, tick > 0 ? partial_metrics_t::SUCCESS : partial_metrics_t::UNDECIDED);
    EXPECT_EQ(ExtendedValue(partial.extended, "success_end"), tick == 1 ? 1 : 0) << tick;
  }
  EXPECT_EQ(dut_.verdict_time_us(), 20'000);
}

TEST_F(AfterSuccess, ChangesNoOtherValue) {
  EpisodeScorer plain(ModelOf(0), task_);
  const episode_summary_t before = Play(&plain, {false, false, false, true});
  for (EpisodeScorer* dut : {&dut_, &plain}) {
    episode_summary_t after = Play(dut, {false, false, false, true, true, false, false, true, false});
    EXPECT_EQ(after.header.tick, 8);
    after.header = before.header;
    extended_metrics_t& e = after.extended;
    if (dut == &dut_) {
      ASSERT_GT(e.num_values, 3);
      EXPECT_EQ(e.name[e.name.size() - 3], "success_once");
      e.num_values -= 3;
      e.name.resize(e.name.size() - 3);
      e.unit.resize(e.name.size());
      e.value_mixed.resize(e.name.size());
    }
    EXPECT_EQ(Encode(after), Encode(before));
    EXPECT_EQ(e.action_clips, 3);
    EXPECT_EQ(e.unreachable_poses, 3);
    EXPECT_EQ(e.singular_poses, 3);
  }
}

TEST_F(AfterSuccess, TicksThatAreMissingMakeItIncomplete) {
  dut_.Start();
  for (const int64_t tick : {0, 1, 3}) {
    state_t state = State(tick);
    if (tick > 0) state.body[kPot].position_m[2] = 1.25;
    dut_.Tick(state, Contacts(tick, {}));
  }
  episode_end_t end{};
  end.header = Header(3);
  end.end_reason = "success";
  EXPECT_FALSE(dut_.Summary({}, end).complete);
  // Refused samples cannot prove a success either.
  dut_.Start();
  for (const int64_t tick : {0, 1, 2}) {
    state_t state = State(tick);
    if (tick > 0) state.body[kPot].position_m[2] = tick == 2 ? 1 / 0. : 1.25;
    dut_.Tick(state, Contacts(tick, {}));
  }
  end.header = Header(2);
  EXPECT_FALSE(dut_.Summary({}, end).complete);
  EXPECT_EQ(dut_.refused_samples(), 1);
}

TEST_F(AfterSuccess, AllocatesNothingAfterTheFirstEpisode) {
  partial_metrics_t partial{};
  const contacts_t contacts = Contacts(1, {});
  std::vector<state_t> states;
  for (int64_t tick = 0; tick < 8; ++tick) {
    states.push_back(State(tick));
    if (tick > 2) states.back().body[kPot].position_m[2] = 1.25;
  }
  int64_t before = 0;
  for (int episode = 0; episode < 2; ++episode) {
    dut_.Start();
    for (const state_t& state : states) {
      // The explanation is computed at the tick of the verdict, so allocations are counted only after it.
      if (state.header.tick == 4) before = AllocationCount();
      dut_.Tick(state, contacts);
      dut_.Partial(&partial);
    }
  }
  EXPECT_EQ(AllocationCount() - before, 0);
}

// Every shipped task fits the scene that it describes.
TEST(ShippedTasks, CompileAgainstTheirScenes) {
  const std::vector<TaskDescription> tasks = AllTasks();
  EXPECT_GE(tasks.size(), 1);
  for (const TaskDescription& task : tasks) {
    const Scene scene = BuildScene(task, LoadRobot(task.robot_file));
    model_info_t info = scene.info;
    info.substeps = 10;
    EXPECT_NO_THROW(EpisodeScorer(info, task)) << task.name;
  }
}

}  // namespace evalbus::metrics::episode_scorer_test
