#include <gtest/gtest.h>

#include <cmath>

#include "policy_bridge/planning/joint_path.h"
#include "policy_bridge/planning/min_jerk.h"
#include "policy_bridge/planning/plan.h"
#include "sim/world.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::motion_test {

JointVector Joints(double a, double b) { return Eigen::Vector2d(a, b); }

Configuration At(const Motion& motion, double t) {
  Configuration now;
  motion.At(t, &now);
  return now;
}

TEST(MinJerk, BoundaryConditions) {
  EXPECT_EQ(MinJerk(0), 0);
  EXPECT_EQ(MinJerk(1), 1);
  EXPECT_EQ(MinJerk(-1), 0);
  EXPECT_EQ(MinJerk(2), 1);
  EXPECT_EQ(MinJerkRate(0), 0);
  EXPECT_EQ(MinJerkRate(1), 0);
  EXPECT_DOUBLE_EQ(MinJerkRate(0.5), kMinJerkPeakRate);
  constexpr double kStep = 1e-5;
  // The acceleration is also zero at both ends.
  EXPECT_NEAR(MinJerkRate(kStep) / kStep, 0, 1e-3);
  EXPECT_NEAR(MinJerkRate(1 - kStep) / kStep, 0, 1e-3);
  for (double t = 0.01; t < 1; t += 0.01) {
    EXPECT_NEAR(MinJerkRate(t), (MinJerk(t + kStep) - MinJerk(t - kStep)) / (2 * kStep), 1e-6);
    EXPECT_LE(MinJerkRate(t), kMinJerkPeakRate);
  }
}

TEST(JointPath, PassesThroughKnotsSmoothly) {
  const JointPath path({Joints(0, 0), Joints(1, -1), Joints(0.5, 2), Joints(3, 1)});
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT((path.At(i / 3.0) - path.knots()[i]).norm(), 1e-12);
  }
  constexpr double kStep = 1e-6;
  for (double s = 0.001; s < 1; s += 0.0499) {
    const JointVector slope = (path.At(s + kStep) - path.At(s - kStep)) / (2 * kStep);
    EXPECT_LT((path.Slope(s) - slope).norm(), 1e-6);
  }
  // Slope and curvature are continuous at an inner knot.
  const double knot = 1 / 3.0;
  EXPECT_LT((path.Slope(knot - 1e-9) - path.Slope(knot + 1e-9)).norm(), 1e-6);
  const auto curvature = [&](double s) -> JointVector {
    return (path.Slope(s + 1e-5) - path.Slope(s)) / 1e-5;
  };
  EXPECT_LT((curvature(knot - 1.1e-5) - curvature(knot + 1e-7)).norm(), 0.1);
}

TEST(JointPath, OneKnotStaysAndTwoAreALine) {
  const JointPath rest({Joints(1, 2)});
  EXPECT_EQ(rest.At(0.3), Joints(1, 2));
  EXPECT_EQ(rest.Slope(0.3), Joints(0, 0));
  const JointPath line({Joints(0, 0), Joints(1, 2)});
  EXPECT_LT((line.At(0.25) - Joints(0.25, 0.5)).norm(), 1e-15);
}

class PlanTest : public testing::Test {
 protected:
  void SetUp() override {
    const PolicyScene& scene = GetPolicyScene();
    sim::World world(&scene.model(), scene.info(), scene.robot, scene.task, 10);
    world.Reset(1, scene.task.variation("base"));
    world.Fill(&state_);
  }
  Eigen::Isometry3d Grip(int arm, const Configuration& at) {
    return context_.arms[arm].GripPose(at.joints[arm]);
  }

  PlanningContext context_{GetPolicyScene().model(), GetPolicyScene().info()};
  state_t state_{};
};

TEST_F(PlanTest, ReachGoesStraightWithinSpeedLimits) {
  Eigen::Isometry3d goal = Eigen::Translation3d(-0.1, -0.05, 0.1) * Grip(0, context_.home);
  goal.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()));
  Plan plan(&context_, context_.home, state_);
  plan.Reach({{0, goal}}).CheckContacts({0, 1});
  ASSERT_TRUE(plan.feasible());
  ASSERT_EQ(plan.motions().size(), 1u);
  const Motion& motion = plan.motions()[0];
  EXPECT_LT((Grip(0, plan.end()).matrix() - goal.matrix()).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_EQ(plan.end().joints[1], context_.home.joints[1]);

  const Eigen::Vector3d from = Grip(0, context_.home).translation(), to = goal.translation();
  constexpr double kStep = 1e-3;
  double fastest = 0;
  for (double t = 0; t + kStep < motion.duration; t += kStep) {
    const Configuration a = At(motion, t), b = At(motion, t + kStep);
    fastest = std::max(fastest, (b.joints[0] - a.joints[0]).cwiseAbs().maxCoeff() / kStep);
    const Eigen::Vector3d offset = Grip(0, a).translation() - from;
    const Eigen::Vector3d way = (to - from).normalized();
    EXPECT_LT((offset - way * way.dot(offset)).norm(), 1e-3);
  }
  EXPECT_LE(fastest, context_.limits.joint_speed * 1.02);
  EXPECT_LT((At(motion, 0).joints[0] - context_.home.joints[0]).norm(), 1e-12);
}

TEST_F(PlanTest, OutOfReachIsInfeasibleAndEndsThePlan) {
  Eigen::Isometry3d goal = Eigen::Translation3d(1.5, 0, 0) * Grip(1, context_.home);
  Plan plan(&context_, context_.home, state_);
  plan.Close({0}).Reach({{1, goal}}).Open({0});
  EXPECT_FALSE(plan.feasible());
  EXPECT_EQ(plan.motions().size(), 1u);
}

TEST_F(PlanTest, ContactsAreSeen) {
  // This motion goes down into the counter.
  Eigen::Isometry3d goal = Grip(0, context_.home);
  goal.translation().z() = 0.85;
  Plan plan(&context_, context_.home, state_);
  plan.Reach({{0, goal}});
  ASSERT_TRUE(plan.feasible());
  EXPECT_TRUE(Plan(plan).CheckContacts({1}).feasible());
  EXPECT_FALSE(plan.CheckContacts({0}).feasible());
}

TEST_F(PlanTest, CarryKeepsBothGripsFixedInTheObject) {
  const Eigen::Isometry3d from(Eigen::Translation3d(0.65, 0, 1));
  const Eigen::Isometry3d to =
      Eigen::Translation3d(0.62, 0.03, 1.1) * Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ());
  Plan plan(&context_, context_.home, state_);
  plan.Carry(0, from, to, {0, 1});
  ASSERT_TRUE(plan.feasible());
  for (int i = 0; i <= 20; ++i) {
    const Configuration at = At(plan.motions()[0], plan.motions()[0].duration * i / 20);
    const Eigen::Isometry3d between = Grip(0, at).inverse() * Grip(1, at);
    const Eigen::Isometry3d before = Grip(0, context_.home).inverse() * Grip(1, context_.home);
    EXPECT_LT((between.translation() - before.translation()).norm(), 2e-3);
  }
}

TEST_F(PlanTest, PlayerIsContinuousAcrossMotions) {
  const Eigen::Isometry3d up = Eigen::Translation3d(0, 0, 0.05) * Grip(0, context_.home);
  Plan plan(&context_, context_.home, state_);
  plan.Reach({{0, up}}).Close({0}).GoHome({0});
  ASSERT_TRUE(plan.feasible());
  double duration = 0;
  for (const Motion& motion : plan.motions()) duration += motion.duration;
  Player player;
  player.Reset(context_.home);
  EXPECT_TRUE(player.done());
  player.Start(plan.motions(), 1);
  Configuration last = player.At(1);
  for (double t = 1; t < 1 + duration + 0.1; t += 0.002) {
    const Configuration now = player.At(t);
    EXPECT_LT((now.joints[0] - last.joints[0]).cwiseAbs().maxCoeff(), 0.0025);
    EXPECT_LT(std::abs(now.closing[0] - last.closing[0]), 0.01);
    last = now;
  }
  EXPECT_TRUE(player.done());
  EXPECT_LT((last.joints[0] - context_.home.joints[0]).norm(), 1e-12);
  EXPECT_EQ(last.closing[0], 1);
}

}  // namespace evalbus::policy::motion_test
