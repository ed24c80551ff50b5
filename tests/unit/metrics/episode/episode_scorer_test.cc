#include "metrics/episode/episode_scorer.h"

#include <gtest/gtest.h>

#include <limits>

#include "lcmtypes/extended_value.h"
#include "metrics/episode/result_json.h"
#include "models/robot_description.h"
#include "models/scene.h"
#include "tests/unit/allocation_count.h"
#include "tests/unit/small_world.h"

namespace evalbus::metrics {
namespace {

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
  dut_.Tick(State(2), Contacts(2, {{kLeftLink, kRightLink}, {kTop, kWall}}));  // lost: a slip
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

// 0.02 * 230 is 4.6000000000000005.
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

// NaN is in no range, and so "not" of any range would be true of it.
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

// The summary itself and its line of episodes.jsonl say the same to statistics.
TEST_F(EpisodeScorerTest, MessageAndJsonGiveOneResult) {
  dut_.Start();
  dut_.Tick(State(0), Contacts(0, {{kLeftPad, kWall}}));
  dut_.Tick(State(1), Contacts(1, {{kLeftLink, kTop}, {kLeftLink, kRightLink}}));
  const episode_summary_t summary = Summary("time_limit", 1);
  const EpisodeResult a = ResultOf(summary);
  const EpisodeResult b = ResultOf({{"complete", true},
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
        std::pair("success", false), std::pair("failure", false)}) {
    dut_.Start();
    dut_.Tick(State(0), Contacts(0));
    dut_.Tick(State(1), Contacts(1));
    EXPECT_EQ(Summary(end_reason, 1).complete != 0, complete) << end_reason;
  }
}

// Every task that ships fits the scene it describes.
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

}  // namespace
}  // namespace evalbus::metrics
