#include "policy_bridge/policies/simple_policies.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::simple_policies_test {

std::vector<double> Home() {
  std::vector<double> home;
  for (const arm_info_t& arm : GetPolicyScene().info().arm) {
    home.insert(home.end(), arm.joint_home_rad.begin(), arm.joint_home_rad.end());
  }
  return home;
}

state_t StateAfter(int64_t time_us) {
  state_t state{};
  state.header.sim_time_us = time_us;
  return state;
}

TEST(Random, NumbersArePinned) {
  // These values are the same on every platform. If they changed, the seeds of recorded runs would give
  // different episodes.
  Random random(42, 7);
  const double first = random.Uniform(0, 1), second = random.Uniform(-2, 2);
  EXPECT_NEAR(first, 0.016286973765900159, 1e-15);
  EXPECT_NEAR(second, 0.74968900140254613, 1e-15);
  EXPECT_NE(Random(42, 8).Uniform(0, 1), first);
  EXPECT_NE(Random(42 + (int64_t{1} << 32), 7).Uniform(0, 1), first);
}

TEST(SmoothNoise, StartsAtZeroAndStaysWithinItsAmplitude) {
  Random random(1, 0);
  const SmoothNoise noise(&random, 0.1, 0.7);
  EXPECT_EQ(noise.At(0), 0);
  double largest = 0, fastest = 0;
  for (double t = 0; t < 60; t += 0.01) {
    largest = std::max(largest, std::abs(noise.At(t)));
    fastest = std::max(fastest, std::abs(noise.At(t + 0.01) - noise.At(t)) / 0.01);
  }
  EXPECT_LE(largest, 0.1);
  EXPECT_GT(largest, 0.03);
  EXPECT_LT(fastest, 0.7);
}

TEST(HoldPolicy, StaysAtHome) {
  HoldPolicy hold(GetPolicyScene().info());
  action_t action{};
  hold.Begin({});
  hold.Act(StateAfter(5'000'000), &action);
  EXPECT_EQ(action.mode, action_t::JOINT_POSITION);
  EXPECT_EQ(action.joint_position_rad, Home());
  EXPECT_EQ(action.num_joints, 14);
  EXPECT_EQ(action.gripper_closing, (std::vector<double>{0, 0}));
  EXPECT_EQ(action.num_grippers, 2);
}

TEST(RandomPolicy, IsSmoothWithinLimitsAndSeeded) {
  RandomPolicy random(GetPolicyScene().info());
  const auto play = [&](int64_t seed) {
    episode_begin_t begin{};
    begin.seed = seed;
    random.Begin(begin);
    std::vector<std::vector<double>> targets;
    action_t action{};
    for (int64_t t = 0; t < 20'000'000; t += 20'000) {
      random.Act(StateAfter(t), &action);
      targets.push_back(action.joint_position_rad);
      for (const double closing : action.gripper_closing) {
        EXPECT_GE(closing, 0);
        EXPECT_LE(closing, 1);
      }
    }
    return targets;
  };
  const auto targets = play(1);
  EXPECT_EQ(targets[0], Home());
  double fastest = 0;
  for (size_t i = 1; i < targets.size(); ++i) {
    for (size_t j = 0; j < 14; ++j) {
      fastest = std::max(fastest, std::abs(targets[i][j] - targets[i - 1][j]) / 0.02);
      const arm_info_t& arm = GetPolicyScene().info().arm[j / 7];
      EXPECT_GE(targets[i][j], arm.joint_lower_rad[j % 7]);
      EXPECT_LE(targets[i][j], arm.joint_upper_rad[j % 7]);
    }
  }
  EXPECT_LT(fastest, 1.0);
  EXPECT_GT(fastest, 0.1);
  EXPECT_EQ(play(1), targets);
  EXPECT_NE(play(2), targets);
}

}  // namespace evalbus::policy::simple_policies_test
