// Tests how and why an episode ended, with short episodes, and the wording and the numbers of the
// explanation.
#include "metrics/episode/explanation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "metrics/episode/episode_scorer.h"
#include "metrics/episode/result_json.h"
#include "tests/unit/set_array.h"
#include "tests/unit/small_world.h"

namespace evalbus::metrics::explanation_test {

using namespace small_world;

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

const std::string kSuccessOfTask = R"(success:
  all:
    - not: {touching: {a: pot, b: counter}}
    - height_above: {object: pot, min_m: 1.1}
)";

class ExplanationTest : public testing::Test {
 protected:
  ExplanationTest() { Use(kTask); }
  void Use(const std::string& task) {
    dut_ = std::make_unique<EpisodeScorer>(Model(), ParseTask(task, "small.yaml", false));
    Restart();
  }
  void UseSuccess(const std::string& success) {
    Use(Replaced(kTask, kSuccessOfTask, "success: " + success + "\n"));
  }
  void Restart() {
    tick_ = -1;
    state_ = State(0);
    dut_->Start();
    Tick();
  }
  void Tick(const std::vector<std::pair<int, int>>& contacts = {{kTop, kWall}}) {
    state_.header = Header(++tick_);
    dut_->Tick(state_, Contacts(tick_, contacts));
  }
  void Hold(int ticks = 1) {
    for (int k = 0; k < ticks; ++k) Tick({{kLeftPad, kWall}, {kTop, kWall}});
  }
  // The left gripper holds the pot for six ticks and loses it while it remains closed.
  void GraspAndLose() {
    Close();
    Hold(6);
    for (int k = 0; k < 16; ++k) Tick();
  }
  void Tilt(double degrees) {
    const double half = degrees * std::numbers::pi / 360;
    Set(&state_.body[kPot].quat_wxyz, {std::cos(half), std::sin(half), 0, 0});
  }
  episode_summary_t End(const std::string& reason = "time_limit") {
    episode_end_t end{};
    end.header = Header(tick_);
    end.end_reason = reason;
    return dut_->Summary({}, end);
  }
  std::string Reason(const std::string& end = "time_limit") { return End(end).failure_reason; }
  std::string Text() { return End().explanation.text; }
  double& Height() { return state_.body[kPot].position_m[2]; }
  // The left gripper is commanded to close, and something keeps it open.
  void Close() {
    state_.gripper[0].opening = 0.4;
    state_.gripper[0].closing_command = 1;
  }

  std::unique_ptr<EpisodeScorer> dut_;
  state_t state_{};
  int64_t tick_ = -1;
};

TEST_F(ExplanationTest, TimeoutWhereNothingWasTried) {
  Tick();
  EXPECT_EQ(Reason(), "timeout");
  EXPECT_EQ(Text(), "time limit at 0.02 s: pot touches counter; no stage reached");
}

TEST_F(ExplanationTest, TheReasonIsTheCategoryOfTheCause) {
  GraspAndLose();
  const episode_summary_t summary = End();
  EXPECT_EQ(summary.cause.kind, "lost_object");
  EXPECT_EQ(summary.cause.tick, 6);
  EXPECT_EQ(summary.failure_reason, "grasp_slip");
  // The explanation first states how the episode ended.
  EXPECT_TRUE(summary.explanation.text.starts_with("time limit at 0.44 s: pot touches counter;"))
      << summary.explanation.text;
}

TEST_F(ExplanationTest, SlipsAreListed) {
  Hold();
  Tick();
  EXPECT_EQ(Reason(), "timeout") << "too short for a hold";
  const explanation_t explanation = End().explanation;
  ASSERT_EQ(explanation.num_slips, 1);
  EXPECT_EQ(explanation.slip[0].object, "pot");
  EXPECT_EQ(explanation.slip[0].gripper, "left");
  EXPECT_EQ(explanation.slip[0].tick, 2);
  EXPECT_EQ(explanation.slip[0].time_s, 0.04);
  EXPECT_EQ(
      explanation.text,
      "time limit at 0.04 s: pot touches counter; highest stage 1 (held) at 0.02 s; pot slipped from left at "
      "0.04 s");
}

TEST_F(ExplanationTest, TheLossOfAnObjectCausesAFailureCondition) {
  Tick({{kFloor, kWall}});
  EXPECT_EQ(Reason("failure"), "failure_condition");
  EXPECT_EQ(End("failure").explanation.text, "failure at 0.02 s: pot touches world; no stage reached");
  Restart();
  GraspAndLose();
  Tick({{kFloor, kWall}});
  EXPECT_EQ(Reason("failure"), "grasp_slip");
}

TEST_F(ExplanationTest, AFailureConditionOnTheRobotIsACollision) {
  Use(Replaced(kTask, "failure: {touching: {a: pot, b: world}}",
               "failure: {touching: {a: counter, b: left}}"));
  Tick({{kLeftLink, kTop}});
  EXPECT_EQ(Reason("failure"), "collision");
  const explanation_t explanation = End("failure").explanation;
  EXPECT_EQ(explanation.text,
            "failure at 0.02 s: counter touches left; no stage reached; first collision at 0.02 s, "
            "left/link with "
            "counter/top");
  EXPECT_EQ(explanation.first_collision_tick, 1);
  EXPECT_EQ(explanation.collision_name, (std::vector<std::string>{"counter/top"}));
  EXPECT_EQ(explanation.collision_count, (std::vector<int64_t>{1}));
}

TEST_F(ExplanationTest, WrongPoseIsATiltOfAHeldObject) {
  UseSuccess(
      "{all: [{height_above: {object: pot, min_m: 1.1}}, {tilt_below: {object: pot, axis: y, max_deg: "
      "20}}]}");
  Height() = 1.2;
  Tilt(27.4);
  Tick({});
  EXPECT_EQ(Reason(), "timeout") << "never held";
  Close();
  Hold(6);
  EXPECT_EQ(Reason(), "wrong_pose");
  const explanation_t explanation = End().explanation;
  ASSERT_EQ(explanation.num_conditions, 1);
  const condition_t& condition = explanation.condition[0];
  EXPECT_EQ(condition.text, "tilt of pot 27.4 degrees > 20");
  EXPECT_EQ(condition.predicate, "tilt_below");
  EXPECT_EQ(condition.subject, "pot");
  EXPECT_NEAR(condition.value_mixed, 27.4, 1e-12);
  EXPECT_EQ(condition.threshold_mixed, 20);
  EXPECT_EQ(condition.comparison, "<=");
  EXPECT_EQ(condition.unit, "deg");
  EXPECT_EQ(condition.tick, 7);
  EXPECT_FALSE(condition.holds);
}

TEST_F(ExplanationTest, AnglesHaveHundredthsBelowADegreeAndTenthsAbove) {
  for (const auto& [angle, text] : {std::pair(0.032, "0.03 degrees <= 20"),
                                    {0.5, "0.50 degrees <= 20"},
                                    {12.345, "12.3 degrees <= 20"},
                                    {20.01, "20.01 degrees > 20"}}) {
    UseSuccess("{tilt_below: {object: pot, axis: y, max_deg: 20}}");
    Tilt(angle);
    Tick();
    EXPECT_EQ(End().explanation.condition.at(0).text, "tilt of pot " + std::string(text));
  }
}

// A threshold must not be rounded to a different value when it is shown.
TEST_F(ExplanationTest, ANumberNearItsLimitHasEnoughDigitsForTheComparison) {
  for (const auto& [limit, height, text] : {std::tuple("1.096", 1.0961, "1.096 m >= 1.096"),
                                            {"1.096", 1.1034, "1.103 m >= 1.096"},
                                            {"1.096", 1.096, "1.096 m >= 1.096"},
                                            {"1.096", 1.09599996, "1.09599996 m < 1.096"},
                                            {"1.096", 1.09979, "1.100 m >= 1.096"},
                                            {"1.096", 2.0, "2.000 m >= 1.096"},
                                            {"1.1", 1.1034, "1.103 m >= 1.1"},
                                            {"1.12345678", 1.12345679, "1.12345679 m >= 1.12345678"},
                                            {"1.12345678", 1.12345677, "1.123 m < 1.12346"},
                                            {"0", -1e-9, "-1e-09 m < 0"},
                                            {"0", -0.0, "0 m >= 0"},
                                            {"-2", 12345.6, "12345.600 m >= -2"}}) {
    SCOPED_TRACE(text);
    UseSuccess("{height_above: {object: pot, min_m: " + std::string(limit) + "}}");
    Height() = height;
    Tick({});
    EXPECT_EQ(End().explanation.condition.at(0).text, "height of pot " + std::string(text));
  }
}

TEST_F(ExplanationTest, TheSameConditionIsReportedOnce) {
  UseSuccess(
      "{any: [{all: [{touching: {a: pot, b: world}}, {height_above: {object: pot, min_m: 9}}]}, {touching: "
      "{a: "
      "pot, b: world}}, {height_above: {object: pot, min_m: 9}}]}");
  Tick();
  EXPECT_EQ(Text(),
            "time limit at 0.02 s: pot does not touch world, height of pot 1.000 m < 9; no stage reached");
  EXPECT_EQ(End().explanation.num_conditions, 3);
}

TEST_F(ExplanationTest, RobotOutOfBounds) {
  Set(&state_.body[kRightHand].position_m, {8, 8, 0});
  Tick();
  EXPECT_EQ(Reason("failure"), "robot_out_of_bounds");
  EXPECT_EQ(End("failure").explanation.condition[0].text,
            "right/hand is 11.3 m from the origin, more than 10 m");
}

TEST_F(ExplanationTest, TheSimsEndsGoBeforeWhatTheObjectsDid) {
  Hold();
  Tick();  // a slip
  for (const char* reason : {"unstable", "policy_error", "policy_timeout", "aborted"}) {
    EXPECT_EQ(Reason(reason), reason);
  }
  EXPECT_EQ(Reason("success"), "unconfirmed");
  EXPECT_EQ(Reason("failure"), "unconfirmed");
}

TEST_F(ExplanationTest, DataThatEndIsNoTimeout) {
  Tick();
  EXPECT_EQ(Reason("end_of_data"), "end_of_data");
  GraspAndLose();
  EXPECT_EQ(Reason("end_of_data"), "grasp_slip");
}

TEST_F(ExplanationTest, SuccessExplainsWhatHeld) {
  Height() = 1.13;
  Tick({{kLeftPad, kWall}});
  const episode_summary_t summary = End("success");
  EXPECT_EQ(summary.failure_reason, "");
  EXPECT_EQ(summary.explanation.text,
            "success at 0.02 s: pot does not touch counter, height of pot 1.130 m >= 1.1; highest stage 2 "
            "(lifted) at "
            "0.02 s");
  ASSERT_EQ(summary.explanation.num_grasps, 1);
  EXPECT_EQ(summary.explanation.grasp[0].gripper, "left");
  EXPECT_EQ(summary.explanation.grasp[0].duration_s, 0.02);
}

TEST_F(ExplanationTest, NestedPredicatesNameWhatDecides) {
  // A false `any` names all operands, `not` its operand, and a false `all` its first false operand.
  UseSuccess(
      "{all: [{any: [{touching: {a: pot, b: world}}, {height_above: {object: pot, min_m: 1.1}}]}, {not: "
      "{touching: {a: "
      "pot, b: counter}}}]}");
  Height() = 1.0999999;
  Tick();
  EXPECT_EQ(
      Text(),
      "time limit at 0.02 s: pot does not touch world, height of pot 1.0999999 m < 1.1; no stage reached");
  Height() = 1.5;
  Tick();
  EXPECT_EQ(End().explanation.condition[0].text, "pot touches counter");
  EXPECT_TRUE(End().explanation.condition[0].holds);
}

TEST_F(ExplanationTest, LatchedNamesTheTickAtWhichItBecameTrue) {
  Use(Replaced(
      Replaced(kTask, kSuccessOfTask, "success: {height_above: {object: pot, min_m: 9}}\n"),
      "failure: {touching: {a: pot, b: world}}",
      "failure: {all: [{latched: {touching: {a: left, b: counter}}}, {touching: {a: pot, b: world}}]}"));
  Tick({{kLeftLink, kTop}});
  Tick();
  Tick({{kFloor, kWall}});
  const explanation_t explanation = End("failure").explanation;
  ASSERT_EQ(explanation.num_conditions, 2);
  EXPECT_EQ(explanation.condition[0].text, "left touches counter");
  EXPECT_EQ(explanation.condition[0].tick, 1);
  EXPECT_EQ(explanation.condition[1].tick, 3);
}

TEST_F(ExplanationTest, AsJson) {
  Hold();
  Tick({{kLeftLink, kTop}, {kLeftLink, kRightLink}});
  EXPECT_EQ(
      ExplanationJson(End().explanation).dump(),
      R"({"text":"time limit at 0.04 s: height of pot 1.000 m < 1.1; highest stage 1 (held) at 0.02 s; )"
      R"(first collision at 0.04 s, left/link with counter/top; pot slipped from left at 0.04 s",)"
      R"("last_stage":{"index":1,"name":"held","time_s":0.02},)"
      R"("conditions":[{"text":"height of pot 1.000 m < 1.1","predicate":"height_above","subject":"pot",)"
      R"("holds":false,"value":1.0,"comparison":">=","threshold":1.1,"unit":"m","tick":2,"time_s":0.04}],)"
      R"("first_collision":{"robot_geom":"left/link","scene_geom":"counter/top","tick":2,"time_s":0.04},)"
      R"("collisions_per_geom":{"counter/top":1,"left/link + right/link":1},)"
      R"("slips":[{"object":"pot","gripper":"left","tick":2,"time_s":0.04}],)"
      R"("grasps":[{"object":"pot","gripper":"left","tick":1,"time_s":0.02,"duration_s":0.02}]})");
  Restart();
  const auto empty = ExplanationJson(End("aborted").explanation);
  EXPECT_TRUE(empty["last_stage"].is_null());
  EXPECT_TRUE(empty["first_collision"].is_null());
  EXPECT_TRUE(empty["conditions"].empty());
}

TEST_F(ExplanationTest, NothingSurvivesStart) {
  Hold(3);
  Tick({{kLeftLink, kTop}});
  Restart();
  Tick();
  const explanation_t again = End().explanation;
  Use(kTask);
  Tick();
  EXPECT_EQ(ExplanationJson(again).dump(), ExplanationJson(End().explanation).dump());
}

}  // namespace evalbus::metrics::explanation_test
