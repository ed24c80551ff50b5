// Compares force metrics of the same motion at several control rates. An arm presses its hand on the counter.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "lcmtypes/extended_value.h"
#include "metrics/episode/episode_scorer.h"
#include "models/scene.h"
#include "sim/world.h"

namespace evalbus::sim::force_rates_test {

constexpr int kStepsPerSecond = 500;

class ForceRates : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    task_ = new TaskDescription(FindTask("lift_pot").task);
    robot_ = new RobotDescription(LoadRobot(task_->robot_file));
    scene_ = new Scene(BuildScene(*task_, *robot_));
  }
  static void TearDownTestSuite() {
    delete scene_;
    delete robot_;
    delete task_;
  }

  // Plays three seconds. shoulder(t) is added to the home position of the second joint of the left arm.
  static extended_metrics_t Play(int substeps, const std::function<double(double)>& shoulder) {
    model_info_t info = scene_->info;
    info.substeps = substeps;
    World world(scene_->physics.get(), info, *robot_, *task_, substeps);
    world.Reset(0, task_->variation("base"));
    metrics::EpisodeScorer scorer(info, *task_);
    scorer.Start();
    action_t action{};
    action.mode = action_t::JOINT_POSITION;
    for (const ArmDescription& arm : robot_->arms)
      action.joint_position_rad.insert(action.joint_position_rad.end(), arm.home.begin(), arm.home.end());
    action.num_joints = static_cast<int32_t>(action.joint_position_rad.size());
    action.gripper_closing = {0, 0};
    action.num_grippers = 2;
    const double home = action.joint_position_rad[1];
    for (int tick = 0;; ++tick) {
      state_t state{};
      world.Fill(&state);
      state.header.tick = tick;
      state.header.sim_time_us = tick * world.tick_us();
      contacts_t contacts{};
      contacts.header = state.header;
      scorer.Tick(state, contacts);
      if (tick * substeps >= 3 * kStepsPerSecond) break;
      action.joint_position_rad[1] = home + shoulder(static_cast<double>(tick * substeps) / kStepsPerSecond);
      EXPECT_EQ(world.Apply(action), "");
      EXPECT_TRUE(world.Step());
    }
    partial_metrics_t partial{};
    scorer.Partial(&partial);
    return partial.extended;
  }

  static TaskDescription* task_;
  static RobotDescription* robot_;
  static Scene* scene_;
};
TaskDescription* ForceRates::task_ = nullptr;
RobotDescription* ForceRates::robot_ = nullptr;
Scene* ForceRates::scene_ = nullptr;

// The commands change only every 50 ms, so the physics is the same, and so is every sum over physics steps.
TEST_F(ForceRates, EqualCommandsGiveEqualForces) {
  const auto stairs = [](double t) { return std::floor(t / 0.05 + 1e-9) * 0.05 * 0.4; };
  const extended_metrics_t at_20 = Play(25, stairs), at_500 = Play(1, stairs);
  for (const char* name : {"peak_scene_force_N", "peak_touch_energy_J"}) {
    EXPECT_GT(ExtendedValue(at_20, name), 0) << name;
    EXPECT_EQ(ExtendedValue(at_20, name), ExtendedValue(at_500, name)) << name;
  }
  const double impulse = ExtendedValue(at_20, "unwanted_impulse_Ns");
  EXPECT_NEAR(ExtendedValue(at_500, "unwanted_impulse_Ns"), impulse, 1e-9 * impulse);
}

// At lower rates, the same smooth motion is commanded in coarser steps.
TEST_F(ForceRates, TheSameMotionGivesTheSameForcesWithinFivePercent) {
  const auto press = [](double t) { return 0.9 * std::min(1.0, t / 2); };
  const extended_metrics_t at_500 = Play(1, press);
  for (const int substeps : {25, 5}) {
    SCOPED_TRACE(substeps);
    const extended_metrics_t other = Play(substeps, press);
    for (const char* name : {"peak_scene_force_N", "unwanted_impulse_Ns"}) {
      const double expected = ExtendedValue(at_500, name);
      EXPECT_GT(expected, 1) << name;
      EXPECT_NEAR(ExtendedValue(other, name), expected, 0.05 * expected) << name;
    }
  }
}

}  // namespace evalbus::sim::force_rates_test
