// Tests the effect of each flaw on the targets of a policy that closes its grippers and rests.
#include "policy_bridge/policies/flawed_policy.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "policy_bridge/experts/expert.h"
#include "tests/unit/policy_bridge/policy_scene.h"
#include "tests/unit/set_array.h"

namespace evalbus::policy::flawed_policy_test {

// Commands closed grippers and the home position, from which the first joint of the left arm moves at 0.01
// rad/s.
class RestingPolicy : public Policy {
 public:
  void Begin(const episode_begin_t&) override {}
  void Act(const state_t& state, action_t* action) override {
    Configuration now = HomeConfiguration(GetPolicyScene().info());
    now.closing = {1, 1};
    now.joints[0][0] += static_cast<double>(state.header.sim_time_us) * 1e-6 * 0.01;
    SetAction(now, action);
  }
};

class FlawedPolicyTest : public testing::Test {
 protected:
  FlawedPolicyTest() {
    state_.body.assign(GetPolicyScene().info().num_bodies, {{0, 0, 0}, {1, 0, 0, 0}});
    state_.gripper.resize(2);
    state_.gripper[0].opening = 0.7;
    state_.gripper[1].opening = 0.25;
    pot_ = ObjectBody(GetPolicyScene().info(), "pot");
  }
  void Use(const std::string& flaw) {
    dut_ = std::make_unique<FlawedPolicy>(std::make_unique<RestingPolicy>(), FindFlaw(flaw),
                                          GetPolicyScene().model(), GetPolicyScene().info());
    dut_->Begin({});
    time_us_ = 0;
    MovePot(0, 0);
  }
  void MovePot(double x, double z) { Set(&state_.body[pot_].position_m, {0.7 + x, 0, 0.996 + z}); }
  action_t Act() {
    state_.header.sim_time_us = time_us_;
    state_.header.tick = time_us_ / 20'000;
    time_us_ += 20'000;
    action_t action{};
    dut_->Act(state_, &action);
    return action;
  }
  // Returns the action after this many seconds.
  action_t ActFor(double seconds) {
    action_t action{};
    while (static_cast<double>(time_us_) * 1e-6 <= seconds) action = Act();
    return action;
  }
  static Eigen::Vector3d Grip(const action_t& action, int arm, Eigen::Vector3d* direction = nullptr) {
    static const std::vector<Arm> arms = MakeArms(GetPolicyScene().model(), GetPolicyScene().info());
    const Eigen::Map<const JointVector> joints(action.joint_position_rad.data() + 7 * arm, 7);
    const Eigen::Isometry3d grip = arms[arm].GripPose(joints);
    if (direction) *direction = grip.linear().col(2);
    return grip.translation();
  }
  action_t Plain() const {
    action_t action{};
    RestingPolicy().Act(state_, &action);
    return action;
  }

  std::unique_ptr<FlawedPolicy> dut_;
  state_t state_{};
  int64_t time_us_ = 0;
  int pot_ = 0;
};

TEST_F(FlawedPolicyTest, AMissIsEightCentimetersShort) {
  Use("miss");
  EXPECT_LT((Grip(Act(), 0) - Grip(Plain(), 0)).norm(), 1e-5) << "nothing jumps";
  const action_t missed = ActFor(2);
  for (int arm : {0, 1}) {
    Eigen::Vector3d direction;
    const Eigen::Vector3d wanted = Grip(Plain(), arm, &direction);
    EXPECT_LT((Grip(missed, arm) - (wanted - 0.08 * direction)).norm(), 1e-5);
  }
  EXPECT_EQ(missed.gripper_closing, (std::vector<double>{1, 1}));
}

TEST_F(FlawedPolicyTest, HandsThatCollideGoDownAndOutside) {
  Use("collide");
  const action_t start = Act();
  const Eigen::Vector3d way = Grip(ActFor(1), 1) - Grip(start, 1);
  EXPECT_LT((way - Eigen::Vector3d(0, -0.105, -0.15)).norm(), 1e-5);
}

TEST_F(FlawedPolicyTest, ASlipOpensTheGrippersForATenthOfEveryHalfSecond) {
  const std::vector<double> closed{1, 1}, open{0, 0};
  Use("slip");
  MovePot(0, 0);
  EXPECT_EQ(Act().gripper_closing, closed);
  MovePot(0.011, 0);
  for (int tick = 0; tick < 50; ++tick) {  // 20 ms each
    EXPECT_EQ(Act().gripper_closing, tick % 25 < 5 ? open : closed) << tick;
  }
}

TEST_F(FlawedPolicyTest, ADropIsTwoCentimetersUp) {
  Use("drop");
  const std::vector<double> closed{1, 1}, open{0, 0};
  MovePot(0, 0.1);  // the pot may move before a gripper closes
  EXPECT_EQ(Act().gripper_closing, closed);
  MovePot(0.5, 0.119);
  EXPECT_EQ(Act().gripper_closing, closed);
  MovePot(0, 0.121);
  EXPECT_EQ(Act().gripper_closing, open);
  MovePot(0, 0);
  EXPECT_EQ(Act().gripper_closing, open);
  Use("drop");
  EXPECT_EQ(Act().gripper_closing, closed) << "forgotten";
}

TEST_F(FlawedPolicyTest, EarlyIsOneCentimeterOrATenthOfARadian) {
  const std::vector<double> closed{1, 1}, open{0, 0};
  Use("early");
  Act();
  MovePot(0.009, 0);
  EXPECT_EQ(Act().gripper_closing, closed);
  MovePot(0.011, 0);
  EXPECT_EQ(Act().gripper_closing, open);
  Use("early");
  Act();
  Set(&state_.body[pot_].quat_wxyz, {std::cos(0.049), std::sin(0.049), 0, 0});
  EXPECT_EQ(Act().gripper_closing, closed);
  Set(&state_.body[pot_].quat_wxyz, {std::cos(0.051), std::sin(0.051), 0, 0});
  EXPECT_EQ(Act().gripper_closing, open);
}

TEST_F(FlawedPolicyTest, StopsOnceItHasMovedSomething) {
  Use("stop");
  const action_t first = Act();
  MovePot(0.02, 0);
  const action_t last = Act();
  EXPECT_NE(last.joint_position_rad, first.joint_position_rad);
  EXPECT_EQ(ActFor(3).joint_position_rad, last.joint_position_rad);
}

TEST_F(FlawedPolicyTest, SlowIsATenth) {
  Use("slow");
  const double home = Act().joint_position_rad[0];
  EXPECT_NEAR(ActFor(1.6).joint_position_rad[0] - home, 0.01 * 1.6 / 10, 1e-12);
}

TEST_F(FlawedPolicyTest, ErrorAndNan) {
  Use("error");
  Act();
  MovePot(0.02, 0);
  EXPECT_THROW(Act(), std::runtime_error);
  Use("nan");
  EXPECT_FALSE(std::isnan(Act().joint_position_rad[0]));
  MovePot(0.02, 0);
  EXPECT_TRUE(std::isnan(Act().joint_position_rad[0]));
}

TEST_F(FlawedPolicyTest, UnknownFlawsAreExplained) {
  try {
    FindFlaw("nothing");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(
        error.what(),
        "policy \"flawed_expert\": there is no flaw \"nothing\"; expected one of miss, slip, early, drop, "
        "stop, collide, slow, error, nan");
  }
}

}  // namespace evalbus::policy::flawed_policy_test
