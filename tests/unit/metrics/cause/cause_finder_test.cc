// Tests the decisive moment with a short episode for each case. Expected values were computed by hand. Ticks
// last 0.02 s.
#include "metrics/cause/cause_finder.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "lcmtypes/end_reason.h"

namespace evalbus::metrics::cause_finder_test {

constexpr int kLeft = 0, kRight = 1;
// Entities.
constexpr int kLeftArm = 1, kRightArm = 2, kCounter = 3, kPot = 4;

condition_t Holding(const std::string& gripper) {
  condition_t condition{};
  condition.predicate = "holding";
  condition.kind = condition_t::HOLDING;
  condition.subject = "kitchen_pot";
  condition.other = gripper;
  condition.text = gripper + " gripper touches kitchen_pot";
  return condition;
}

condition_t Height() {
  condition_t condition{};
  condition.predicate = "height_above";
  condition.kind = condition_t::PROGRESS;
  condition.subject = "kitchen_pot";
  condition.has_value = true;
  condition.value_mixed = 1;
  condition.comparison = ">=";
  condition.threshold_mixed = 1.1;
  condition.unit = "m";
  condition.text = "height of kitchen_pot at least 1.1 m";
  return condition;
}

// Two arms are 0.5 m from a pot at a height of 1 m, with open grippers. Each gripper that holds the pot
// reaches a stage. Lifting the pot by 0.1 m is the last stage and a success.
class CauseFinderTest : public testing::Test {
 protected:
  CauseFinderTest() {
    dut_.Start();
    // Closings count only after the wrists have left their start.
    for (auto& wrist : wrist_) wrist[2] = 1.03;
    Tick();
    for (auto& wrist : wrist_) wrist[2] = 1;
  }

  void Tick(int ticks = 1) {
    for (int k = 0; k < ticks; ++k) {
      ++tick_;
      for (int gripper = 0; gripper < 2; ++gripper) {
        conditions_[gripper][0].holds = touching_[gripper];
        reached_[gripper] |= touching_[gripper];
      }
      for (const int section : {2, 3}) {
        condition_t& height = conditions_[section][0];
        height.value_mixed = object_[0][2];
        height.holds = height.value_mixed >= height.threshold_mixed;
      }
      reached_[2] |= conditions_[2][0].holds;
      dut_.Add({.tick = tick_,
                .opening = opening_,
                .closing = closing_,
                .touching = touching_,
                .pinched = with_both_fingers_ ? touching_ : none_,
                .object = object_,
                .wrist = wrist_,
                .body = body_,
                .joints = joints_,
                .commands = commands_,
                .torque = torque_,
                .contacts = contacts_},
               reached_, conditions_);
    }
  }
  // Plays ticks in which the robot's joints move and everything else stays as the test has set it.
  void Move(int ticks) {
    for (int k = 0; k < ticks; ++k) {
      for (double& joint : joints_) joint += 0.03;
      Tick();
    }
  }
  void Close(int gripper, double opening, bool touches) {
    opening_[gripper] = opening;
    touching_[gripper] = touches;
    Tick();
  }
  // Both grippers hold the pot, starting at tick 11 (0.22 s). At tick 20 they have held it for 0.2 s.
  void HoldWithBoth() {
    Move(10);
    opening_ = {0.4, 0.4};
    touching_ = {1, 1};
    Move(10);
  }
  std::string Reason(CauseEnd::By by = CauseEnd::By::kTime, const std::string& reason = "timeout") {
    return dut_.Find({.by = by, .reason = reason, .detail = {}, .last_tick = tick_, .conditions = {}})
        .failure_reason;
  }
  cause_t Find(CauseEnd::By by = CauseEnd::By::kTime, const std::string& reason = "timeout",
               const std::string& detail = "") {
    return dut_.Find({.by = by, .reason = reason, .detail = detail, .last_tick = tick_, .conditions = {}})
        .cause;
  }
  void Expect(const std::string& kind, int64_t tick, const std::string& text) {
    const cause_t cause = Find();
    EXPECT_EQ(cause.kind, kind);
    EXPECT_EQ(cause.tick, tick);
    EXPECT_DOUBLE_EQ(cause.time_s, static_cast<double>(tick) * 0.02);
    EXPECT_EQ(cause.text, text);
  }

  CauseFinder dut_{{.dt = 0.02,
                    .arms = {"left", "right"},
                    .arm_entity = {kLeftArm, kRightArm},
                    .joint_arm = {0, 1},
                    .grippers = {"left", "right"},
                    .gripper_arm = {0, 1},
                    .objects = {"kitchen_pot"},
                    .entities = {"world", "left", "right", "big_counter", "kitchen_pot"},
                    .object_entity = {kPot},
                    .bodies = {"world", "kitchen_pot/body"},
                    .body_entity = {0, kPot}}};
  std::vector<body_pose_t> body_ = {{}, {{0.5, 0, 1}, {1, 0, 0, 0}}};
  int64_t tick_ = -1;
  std::vector<double> opening_ = {1, 1};
  std::vector<double> closing_;
  std::vector<uint8_t> touching_ = {0, 0};
  const std::vector<uint8_t> none_ = {0, 0};
  bool with_both_fingers_ = true;
  std::vector<std::array<double, 3>> object_ = {{0.5, 0, 1}};
  std::vector<std::array<double, 3>> wrist_ = {{0, 0, 1}, {1, 0, 1}};
  std::vector<double> joints_ = {0, 0};
  std::vector<double> commands_;
  std::vector<double> torque_ = {2, 2};
  std::vector<ArmContact> contacts_;
  std::vector<uint8_t> reached_ = {0, 0, 0};
  std::vector<std::vector<condition_t>> conditions_ = {
      {Holding("left")}, {Holding("right")}, {Height()}, {Height()}};
};

TEST_F(CauseFinderTest, AGripperLosesTheObjectWhileItCloses) {
  HoldWithBoth();
  Close(kRight, 0.4, false);  // tick 21; the last contact was at tick 20
  Close(kRight, 0.2, false);
  Move(300);
  Expect("lost_object", 20,
         "Right gripper lost the kitchen pot at 0.40 s while closing (2 of 3 stages by then) and never tried "
         "again; "
         "height "
         "of kitchen pot stayed at 1.000 m, at least 1.1 m is needed.");
  EXPECT_EQ(Reason(), "grasp_slip");
}

TEST_F(CauseFinderTest, AMissedConditionTellsThatItsApproachWasLost) {
  HoldWithBoth();
  object_[0][2] = 1.05;
  Move(5);  // up to tick 25
  object_[0][2] = 1.026;
  Move(300);  // less than half of the approach is lost
  Expect("missed_condition", 21,
         "Last progress at 0.42 s, although the robot kept moving (2 of 3 stages by then); height of kitchen "
         "pot reached 1.050 m, at least 1.1 m is needed.");
  object_[0][2] = 1.024;
  Move(1);
  Expect("missed_condition", 21,
         "Last progress at 0.42 s, although the robot kept moving (2 of 3 stages by then); height of kitchen "
         "pot reached 1.050 m and was 1.024 m at the end, at least 1.1 m is needed.");
}

TEST_F(CauseFinderTest, AGripperOpens) {
  HoldWithBoth();
  object_[0][2] = 1.05;
  Move(5);  // up to tick 25
  Close(kLeft, 0.46, true);
  Close(kLeft, 0.55, true);
  object_[0][2] = 1;
  Close(kLeft, 1, false);
  Move(300);
  Expect("lost_object", 25,
         "Left gripper let go of the kitchen pot at 0.50 s after lifting it by 0.05 m (2 of 3 stages by "
         "then) and "
         "never tried "
         "again; height of kitchen pot reached 1.050 m, at least 1.1 m is needed.");
  EXPECT_EQ(Reason(), "dropped");
}

TEST_F(CauseFinderTest, AnObjectThatStaysOnAnOpenedFingerIsReleased) {
  HoldWithBoth();
  Move(5);  // longer than a hand needs to snap shut; up to tick 25
  opening_[kLeft] = 1;
  with_both_fingers_ = false;
  Move(300);
  EXPECT_EQ(Find().kind, "lost_object");
  EXPECT_EQ(Find().tick, 25);
}

TEST_F(CauseFinderTest, AGripperThatBouncesOnTheObjectDoesNotLetGo) {
  HoldWithBoth();
  opening_[kLeft] = 0.55;
  Move(300);
  EXPECT_EQ(Find().kind, "missed_condition");
  EXPECT_EQ(Reason(), "wrong_pose");
}

TEST_F(CauseFinderTest, AnOpeningWithoutACommandIsNoRelease) {
  closing_ = {1, 1};
  with_both_fingers_ = false;
  HoldWithBoth();
  opening_[kLeft] = 0.6;
  Move(50);
  opening_[kLeft] = 0.4;
  Move(250);
  EXPECT_EQ(Find().kind, "missed_condition");
}

TEST_F(CauseFinderTest, AGripperThatWasCommandedToOpenBrieflyLosesTheObject) {
  closing_ = {1, 1};
  HoldWithBoth();
  closing_[kLeft] = 0.5;
  Move(5);  // up to tick 25
  closing_[kLeft] = 1;
  touching_[kLeft] = 0;
  Move(300);
  EXPECT_EQ(Find().kind, "lost_object") << Find().text;
  EXPECT_TRUE(Find().text.starts_with("Left gripper opened briefly and lost the kitchen pot at 0.50 s"))
      << Find().text;
}

TEST_F(CauseFinderTest, AGripperThatOpensAfterItLostTheObjectDidNotOpenBriefly) {
  closing_ = {1, 1};
  HoldWithBoth();
  touching_[kLeft] = 0;
  Move(5);
  closing_[kLeft] = 0;
  Move(300);
  EXPECT_TRUE(Find().text.starts_with("Left gripper lost the kitchen pot at 0.40 s")) << Find().text;
}

TEST_F(CauseFinderTest, ACommandToOpenIsTheMomentOfARelease) {
  closing_ = {1, 1};
  HoldWithBoth();
  opening_[kLeft] = 0.48;  // the grip bounces
  Move(5);                 // up to tick 25
  closing_[kLeft] = 0;
  opening_[kLeft] = 0.45;
  Move(5);
  Close(kLeft, 1, false);
  Move(300);
  EXPECT_EQ(Find().tick, 25);
  EXPECT_TRUE(Find().text.starts_with("Left gripper let go of the kitchen pot at 0.50 s")) << Find().text;
}

// The fingers need some ticks to open, during which the object is lifted further.
TEST_F(CauseFinderTest, TheLiftIsThatOfTheMoment) {
  closing_ = {1, 1};
  HoldWithBoth();
  object_[0][2] = 1.02;
  Move(5);
  closing_[kLeft] = 0;
  object_[0][2] = 1.06;
  Move(5);
  object_[0][2] = 1;
  Close(kLeft, 1, false);
  Move(300);
  EXPECT_TRUE(
      Find().text.starts_with("Left gripper let go of the kitchen pot at 0.50 s after lifting it by "
                              "0.02 m (2 of 3 stages by then)"))
      << Find().text;
}

TEST_F(CauseFinderTest, PuttingTheObjectDownIsNoLaterLoss) {
  for (const double height : {1.0, 1.05}) {
    SCOPED_TRACE(height);
    dut_.Start();
    tick_ = -1;
    closing_ = {1, 1};
    HoldWithBoth();
    object_[0][2] = 1.05;
    Move(5);
    Close(kLeft, 0.3, false);
    object_[0][2] = 1;
    Move(20);
    object_[0][2] = height;
    Close(kLeft, 0.3, true);
    Move(12);
    closing_[kLeft] = 0;
    Close(kLeft, 1, false);
    object_[0][2] = 1;
    Move(300);
    EXPECT_EQ(Find().text.find("and once more later") != std::string::npos, height > 1) << Find().text;
    opening_ = {1, 1};
    touching_ = {0, 0};
  }
}

TEST_F(CauseFinderTest, AHandThatOpensAfterItLostTheObjectDidNotLetGo) {
  closing_ = {1, 1};
  HoldWithBoth();
  Close(kLeft, 0.3, false);  // tick 21
  Move(5);
  closing_[kLeft] = 0;
  Close(kLeft, 1, false);
  Move(300);
  EXPECT_EQ(Find().tick, 20);
  EXPECT_EQ(Reason(), "grasp_slip");
}

TEST_F(CauseFinderTest, AClosedHandThatBrushesTheObjectDidNotHoldIt) {
  with_both_fingers_ = false;
  Move(10);
  wrist_[kRight][0] = 0.55;
  Close(kRight, 0.5, false);
  Close(kRight, 0.05, false);  // tick 12
  Move(10);
  touching_[kRight] = 1;
  opening_[kRight] = 0;
  Move(20);
  touching_[kRight] = 0;
  Move(300);
  Expect("empty_grasp", 12,
         "Right gripper closed on nothing at 0.24 s (0 of 3 stages by then); height of kitchen pot stayed at "
         "1.000 m, "
         "at least 1.1 m is needed.");
  EXPECT_EQ(Reason(), "grasp_miss");
}

// One finger touches the pot from outside while the gripper closes, and this reaches the stage.
TEST_F(CauseFinderTest, AHandThatClosesBesideTheObjectMissesIt) {
  with_both_fingers_ = false;
  Move(10);
  wrist_[kRight][0] = 0.55;
  for (const double opening : {0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2}) Close(kRight, opening, true);
  Close(kRight, 0.08, true);  // tick 18
  Close(kRight, 0, false);
  Move(300);
  Expect("empty_grasp", 18,
         "Right gripper closed beside the kitchen pot at 0.36 s (1 of 3 stages by then) and never tried "
         "again; height "
         "of kitchen pot stayed at 1.000 m, at least 1.1 m is needed.");
}

TEST_F(CauseFinderTest, StagesCountUntilTheMoment) {
  Close(kLeft, 0.4, true);
  Move(10);
  Close(kLeft, 1, false);
  touching_[kRight] = 1;
  opening_[kRight] = 0.4;
  Move(300);
  EXPECT_NE(Find().text.find("(1 of 3 stages by then)"), std::string::npos) << Find().text;
}

// The blue cube is placed correctly, but the red cube is not brought to it. The gripper holds the blue object
// and releases it. In the last case it then loses the red one, which falls.
TEST(ReleaseAsRequired, IsNoLoss) {
  condition_t on{}, released{}, near{}, lifted{}, held{};
  on.kind = condition_t::CONTACT;
  on.subject = "blue";
  on.other = "table";
  on.text = "blue is on table";
  released.kind = held.kind = condition_t::HOLDING;
  released.subject = held.subject = "blue";
  released.other = "any";
  released.text = "no gripper touches blue";
  held.other = "left";
  held.text = "left gripper touches blue";
  near.kind = condition_t::PROGRESS;
  near.subject = "blue";
  near.other = "red";
  near.text = "distance of blue and red at most 0.1 m";
  near.has_value = true;
  near.value_mixed = 0.3;
  near.threshold_mixed = 0.1;
  near.comparison = "<=";
  near.unit = "m";
  struct Case {
    bool in_place, loses_red;
    std::string kind, text;
  };
  for (const Case& c : {Case{true, false, "missed_condition", "Last progress"},
                        Case{false, false, "lost_object", "Left gripper put down the blue"},
                        Case{false, true, "lost_object", "Left gripper lost the red"}}) {
    CauseFinder dut{{.dt = 0.02,
                     .arms = {"left"},
                     .joint_arm = {0},
                     .grippers = {"left"},
                     .gripper_arm = {0},
                     .objects = {"blue", "red"},
                     .entities = {"world", "left", "table", "blue", "red"},
                     .object_entity = {3, 4},
                     .bodies = {"world", "blue", "red"},
                     .body_entity = {0, 3, 4}}};
    dut.Start();
    std::vector<std::array<double, 3>> object = {{0.5, 0, 1}, {0.5, 0.3, 1}};
    const std::vector<std::array<double, 3>> wrist = {{0.5, 0, 1.1}};
    const std::vector<body_pose_t> body = {{}, {{0.5, 0, 1}, {1, 0, 0, 0}}, {{0.5, 0.3, 1}, {1, 0, 0, 0}}};
    std::vector<double> joints = {0};
    std::vector<uint8_t> reached = {0};
    std::vector<std::vector<condition_t>> conditions = {{held}, {on, released, near}};
    for (int64_t tick = 0; tick < 300; ++tick) {
      const bool holds = tick >= 10 && tick < 100, holds_red = c.loses_red && tick >= 150 && tick < 200;
      const bool is_closed = holds || (c.loses_red && tick >= 150);
      const std::vector<double> opening = {is_closed ? 0.4 : 1.0}, closing = {is_closed ? 1.0 : 0.0};
      const std::vector<uint8_t> touching = {static_cast<uint8_t>(holds), static_cast<uint8_t>(holds_red)};
      if (c.loses_red && tick >= 200) object[1][2] = 0.9;
      reached[0] |= holds;
      conditions[0][0].holds = holds;
      conditions[1][0].holds = c.in_place;
      conditions[1][1].holds = !holds;
      joints[0] += 0.03;
      dut.Add({.tick = tick,
               .opening = opening,
               .closing = closing,
               .touching = touching,
               .pinched = touching,
               .object = object,
               .wrist = wrist,
               .body = body,
               .joints = joints,
               .commands = {},
               .torque = {},
               .contacts = {}},
              reached, conditions);
    }
    const cause_t cause = dut.Find({.by = CauseEnd::By::kTime,
                                    .reason = "timeout",
                                    .detail = {},
                                    .last_tick = 299,
                                    .conditions = {}})
                              .cause;
    EXPECT_EQ(cause.kind, c.kind) << cause.text;
    EXPECT_TRUE(cause.text.starts_with(c.text)) << cause.text;
  }
}

TEST_F(CauseFinderTest, APullBeforeALiftIsNoLoss) {
  HoldWithBoth();
  touching_ = {0, 0};
  Move(50);  // up to tick 70
  touching_ = {1, 1};
  Move(5);
  object_[0][2] = 1.05;
  Move(5);  // up to tick 80
  touching_[kLeft] = 0;
  Move(300);
  EXPECT_EQ(Find().kind, "lost_object");
  EXPECT_EQ(Find().tick, 80);
}

TEST_F(CauseFinderTest, AnObjectThatSlidesOutOfAHandAtRestIsLostByTheStop) {
  HoldWithBoth();
  Tick(110);  // up to tick 130: 2.2 s at rest
  touching_[kLeft] = 0;
  Move(300);
  Expect(
      "stall", 20,
      "Robot stopped moving at 0.40 s (2 of 3 stages by then); left gripper lost the kitchen pot at 2.60 s; "
      "height of kitchen pot stayed at 1.000 m, at least 1.1 m is needed.");
  EXPECT_EQ(Reason(), "stall");
}

TEST_F(CauseFinderTest, AGripperThatClosesWhereAnObjectSlippedOutDidNotCloseOnNothing) {
  touching_[kRight] = 1;  // the open hand touches the pot, whose handle takes up half of the hand's travel
  opening_[kRight] = 0.5;
  Move(3);
  Close(kRight, 0.5, false);
  Close(kRight, 0.05, false);
  Move(300);
  EXPECT_NE(Find().kind, "empty_grasp");
}

TEST_F(CauseFinderTest, TheFirstLossDecidesUnlessTheObjectWasHeldAgain) {
  HoldWithBoth();
  Close(kLeft, 0.4, false);
  Move(50);  // up to tick 71
  touching_[kLeft] = 1;
  Move(50);  // up to tick 121
  touching_ = {1, 0};
  Move(50);
  touching_ = {0, 0};
  Move(50);
  EXPECT_EQ(Find().kind, "lost_object");
  EXPECT_EQ(Find().tick, 121);
  EXPECT_TRUE(Find().text.starts_with("Right gripper lost")) << Find().text;
}

TEST_F(CauseFinderTest, ALossWithoutConsequenceIsNoCause) {
  HoldWithBoth();
  touching_[kLeft] = 0;
  Move(100);
  object_[0][2] = 1.2;  // the other gripper lifts it
  Tick();
  EXPECT_EQ(dut_.Find({.by = CauseEnd::By::kSuccess,
                       .reason = {},
                       .detail = {},
                       .last_tick = tick_,
                       .conditions = {}})
                .cause.text,
            "Success at 2.42 s.");
}

TEST_F(CauseFinderTest, AGripperClosesOnNothing) {
  Move(10);
  wrist_[kRight][0] = 0.7;
  Close(kRight, 0.5, false);
  Close(kRight, 0.05, false);  // tick 12
  Move(300);
  Expect("empty_grasp", 12,
         "Right gripper closed on nothing at 0.24 s (0 of 3 stages by then) and never tried again; height of "
         "kitchen "
         "pot stayed at "
         "1.000 m, at least 1.1 m is needed.");
  EXPECT_EQ(Reason(), "grasp_miss");
}

TEST_F(CauseFinderTest, AGripperThatClosesAtItsStartDidNotCloseOnNothing) {
  dut_.Start();
  tick_ = -1;
  Tick();
  Move(10);
  opening_[kRight] = 0;
  Move(300);
  EXPECT_NE(Find().kind, "empty_grasp") << Find().text;
}

TEST_F(CauseFinderTest, AGripperComesToTheObjectAndDoesNotClose) {
  Move(10);
  wrist_[kRight][0] = 0.6;
  Move(5);  // up to tick 15
  wrist_[kRight][0] = 0.8;
  Move(300);
  Expect(
      "empty_grasp", 15,
      "Right gripper came to the kitchen pot at 0.30 s and did not close (0 of 3 stages by then) and never "
      "tried again; height of kitchen pot stayed at 1.000 m, at least 1.1 m is needed.");
  EXPECT_EQ(Reason(), "grasp_miss");
}

TEST_F(CauseFinderTest, AGripperThatStaysAtTheObjectMayStillClose) {
  Move(10);
  wrist_[kRight][0] = 0.6;
  Move(50);  // 1 s
  EXPECT_NE(Find().kind, "empty_grasp") << Find().text;
}

TEST_F(CauseFinderTest, AGripperThatStaysAtTheObjectUntilTheEndDoesNotClose) {
  Move(10);
  wrist_[kRight][0] = 0.6;
  Move(300);
  Expect(
      "empty_grasp", 11,
      "Right gripper came to the kitchen pot at 0.22 s and did not close (0 of 3 stages by then) and never "
      "tried again; height of kitchen pot stayed at 1.000 m, at least 1.1 m is needed.");
}

TEST_F(CauseFinderTest, ARobotThatStopsAfterItDidNotCloseIsNotTheCause) {
  Move(10);
  wrist_[kRight][0] = 0.6;
  Move(40);  // up to tick 50: 0.8 s at the pot
  Tick(300);
  EXPECT_EQ(Find().kind, "stall") << Find().text;
  dut_.Start();
  tick_ = -1;
  wrist_[kRight][0] = 1;
  Tick();
  Move(10);
  wrist_[kRight][0] = 0.6;
  Move(60);  // up to tick 70: 1.2 s at the pot
  Tick(300);
  EXPECT_EQ(Find().kind, "empty_grasp") << Find().text;
  EXPECT_EQ(Find().tick, 11);
}

TEST_F(CauseFinderTest, AGripperThatReturnsToTheObjectDoesNotClose) {
  Move(10);
  wrist_[kRight][0] = 0.6;
  Move(5);
  wrist_[kRight][0] = 0.8;
  Move(5);
  wrist_[kRight][0] = 0.6;  // tick 21
  Move(300);
  EXPECT_EQ(Find().kind, "empty_grasp") << Find().text;
  EXPECT_EQ(Find().tick, 21);
}

// While the right hand is commanded closed, the pot moves away from it, as if falling, and comes to rest at
// tick 10.
TEST_F(CauseFinderTest, AFallingObjectDoesNotComeToTheGripper) {
  dut_.Start();
  tick_ = -1;
  closing_ = {0, 1};
  object_[0] = {0.9, 0, 1};
  Tick();
  for (int k = 0; k < 9; ++k) {
    object_[0][0] -= 0.04;
    Tick();
  }
  object_[0] = {0.5, 0, 1};
  closing_ = {0, 0};
  Move(10);
  wrist_[kRight][0] = 0.6;
  Move(5);  // up to tick 24
  wrist_[kRight][0] = 0.8;
  Move(300);
  EXPECT_EQ(Find().kind, "empty_grasp") << Find().text;
  EXPECT_EQ(Find().tick, 24);
}

// A closed hand pushes the pot twice; the second time, the pot falls.
TEST_F(CauseFinderTest, AClosedHandPushesTheObjectOffItsSupport) {
  Move(10);
  opening_[kRight] = 0;
  Move(10);
  touching_[kRight] = 1;
  Move(20);
  touching_[kRight] = 0;
  Move(30);
  touching_[kRight] = 1;
  Move(20);  // up to tick 90
  touching_[kRight] = 0;
  object_[0][2] = 0.2;
  Move(300);
  Expect("collision", 90,
         "Right arm pushed the kitchen pot at 1.80 s and it fell (1 of 3 stages by then); height of kitchen "
         "pot reached 1.000 m, at least 1.1 m is needed.");
}

TEST_F(CauseFinderTest, AGripperThatIsCommandedOpenLosesNothing) {
  closing_ = {0, 0};
  Move(10);
  opening_[kRight] = 0.93;  // the pot pushes a finger
  touching_[kRight] = 1;
  Move(20);
  opening_[kRight] = 1;
  touching_[kRight] = 0;
  Move(300);
  EXPECT_NE(Find().kind, "lost_object") << Find().text;
}

TEST_F(CauseFinderTest, AnObjectThatIsTouchedAfterAPushDidNotFallByThePush) {
  Move(10);
  opening_[kRight] = 0;
  Move(10);
  touching_[kRight] = 1;
  Move(20);
  touching_[kRight] = 0;
  Move(100);
  contacts_ = {{kLeft, kPot}};
  Move(1);
  contacts_ = {};
  object_[0][2] = 0.2;
  Move(300);
  EXPECT_EQ(Find().text.find("and it fell"), std::string::npos) << Find().text;
}

// The height is a stage and the success; it is lost when the fist pushes the pot.
TEST_F(CauseFinderTest, AClosedHandPushesAnObjectThatWasPutDown) {
  HoldWithBoth();
  Move(10);
  with_both_fingers_ = false;
  opening_ = {1, 1};
  Move(16);  // up to tick 46
  touching_ = {0, 0};
  object_[0][2] = 1.15;
  Move(4);
  opening_[kRight] = 0;
  Move(20);  // up to tick 70
  touching_[kRight] = 1;
  contacts_ = {{kRight, kPot}};
  for (int k = 0; k < 10; ++k) {
    object_[0][0] += 0.01;
    wrist_[kRight][0] += 0.01;
    Move(1);
  }
  touching_[kRight] = 0;
  contacts_ = {};
  object_[0][2] = 1.05;
  Move(300);
  const std::string text = Find().text;
  EXPECT_TRUE(
      text.starts_with("Right arm hit the kitchen pot with its gripper closed at 1.42 s and pushed it "
                       "by 0.09 m (3 of 3 stages by then)"))
      << text;
}

TEST_F(CauseFinderTest, AClosedHandHitsTheObject) {
  dut_.Start();
  tick_ = -1;
  opening_[kLeft] = 0;
  Tick();
  Move(20);
  contacts_ = {{kLeft, kPot}};
  torque_[0] = 30;
  Move(100);
  const std::string text = Find().text;
  EXPECT_TRUE(text.starts_with("Left arm hit the kitchen pot with its gripper closed at 0.42 s")) << text;
}

// The left gripper has held the pot, and the right one never did.
TEST_F(CauseFinderTest, AConditionThatWasNeverMetLacksBeforeOneThatWas) {
  conditions_[3] = {Height(), Holding("left"), Holding("right")};
  object_[0][2] = 1.2;
  conditions_[3][1].holds = true;
  Move(10);
  conditions_[3][1].holds = false;
  Tick(300);
  const std::string text = Find().text;
  EXPECT_TRUE(text.ends_with("condition not met: right gripper touches kitchen pot.")) << text;
}

// The hand is near the object at the start and only moves away.
TEST_F(CauseFinderTest, AGripperThatNeverApproachedTheObjectDidNotComeToIt) {
  dut_.Start();
  tick_ = -1;
  wrist_[kRight][0] = 0.8;
  Tick();
  Move(10);
  wrist_[kRight][0] = 1;
  Move(300);
  EXPECT_EQ(Find().kind, "missed_condition") << Find().text;
}

TEST_F(CauseFinderTest, AGripperThatPassesFarFromTheObjectDidNotComeToIt) {
  Move(10);
  wrist_[kRight][0] = 0.95;
  Move(5);
  wrist_[kRight][0] = 1.2;
  Move(300);
  EXPECT_EQ(Find().kind, "missed_condition") << Find().text;
}

TEST_F(CauseFinderTest, AGripperThatWasCommandedToCloseAtTheObjectIsNotSaidToStayOpen) {
  closing_ = {0, 0};
  Move(10);
  wrist_[kRight][0] = 0.6;
  closing_[kRight] = 1;
  opening_[kRight] = 0.5;
  Move(5);
  wrist_[kRight][0] = 0.8;
  closing_[kRight] = 0;
  Move(300);
  EXPECT_EQ(Find().kind, "missed_condition") << Find().text;
}

// A hand that is closed pushes the pot with both fingers.
TEST_F(CauseFinderTest, AClosedHandThatPushesTheObjectDoesNotLoseIt) {
  Move(10);
  opening_[kRight] = 0;
  Move(10);
  touching_[kRight] = 1;
  Move(20);
  touching_[kRight] = 0;
  Move(300);
  EXPECT_NE(Find().kind, "lost_object") << Find().text;
}

TEST_F(CauseFinderTest, AHandThatShouldTakeOverALostObjectClosesOnNothingBecauseOfTheLoss) {
  conditions_[kRight][0].other = "other";
  const auto hold_and_lose = [&] {
    Close(kLeft, 0.5, true);
    Move(20);
    Close(kLeft, 1, false);
    Move(20);
  };
  hold_and_lose();
  Close(kRight, 0, false);
  Move(20);
  hold_and_lose();
  Move(300);
  EXPECT_EQ(Find().kind, "lost_object");
}

TEST_F(CauseFinderTest, AGripperThatSnapsShutBouncesAtFirst) {
  Close(kLeft, 0.6, true);
  Move(5);
  with_both_fingers_ = false;
  opening_[kLeft] = 0.76;
  Move(5);  // up to tick 11
  opening_[kLeft] = 0.73;
  Move(17);
  opening_[kLeft] = 1;
  touching_[kLeft] = false;
  Move(300);
  EXPECT_EQ(Find().kind, "lost_object");
  EXPECT_EQ(Find().tick, 28);
}

TEST_F(CauseFinderTest, AnObjectThatPushesTheFingersApartIsNotLetGo) {
  Close(kLeft, 0.5, true);
  Move(20);
  Close(kLeft, 0.7, false);
  Move(5);
  opening_[kLeft] = 0;
  Move(300);
  Expect("lost_object", 21,
         "Left gripper lost the kitchen pot at 0.42 s while closing (1 of 3 stages by then); height of "
         "kitchen pot "
         "stayed at 1.000 m, at least 1.1 m is needed.");
}

// The fingers touch the object again while they close, which begins a short hold.
TEST_F(CauseFinderTest, AnObjectThatIsTouchedAgainWhileItSlipsOutIsNotLetGo) {
  HoldWithBoth();
  Move(5);
  with_both_fingers_ = false;
  Close(kLeft, 0.52, true);
  Close(kLeft, 0.45, true);
  Close(kLeft, 0.3, true);
  Close(kLeft, 0.1, false);
  Move(300);
  EXPECT_EQ(Find().kind, "lost_object");
  EXPECT_EQ(Reason(), "grasp_slip");
  EXPECT_TRUE(Find().text.starts_with("Left gripper lost")) << Find().text;
}

TEST_F(CauseFinderTest, AClosingFarFromTheObjectIsNoAttempt) {
  Close(kRight, 0, false);
  Move(10);
  wrist_[kRight][0] = 0.6;  // 0.4 m closer than where the gripper closed
  Move(300);
  EXPECT_EQ(Find().kind, "missed_condition");
}

TEST_F(CauseFinderTest, AClosingBeforeASuccessfulGraspIsNoCause) {
  Close(kRight, 0, false);
  Close(kRight, 1, false);
  HoldWithBoth();
  Move(300);
  EXPECT_NE(Find().kind, "empty_grasp");
}

TEST_F(CauseFinderTest, AnArmPressesOnTheScene) {
  Move(10);
  contacts_ = {{kLeft, kCounter}};
  Move(5);
  torque_[kLeft] = 80;
  Move(300);
  Expect("collision", 11,
         "Left arm hit the big counter at 0.22 s (0 of 3 stages by then); height of kitchen pot stayed at "
         "1.000 m, at "
         "least 1.1 m is needed.");
}

// Torques of -40 to 0 N m support the arm. A torque outside this range counts as pressing if its distance
// from the range is at least the range's width.
TEST_F(CauseFinderTest, AHeavyArmPressesOnTheScene) {
  torque_[kLeft] = -40;
  Move(10);
  contacts_ = {{kLeft, kCounter}};
  torque_[kLeft] = -70;  // 30 below a range of 40
  Move(100);
  EXPECT_EQ(Find().kind, "missed_condition");
  torque_[kLeft] = 50;
  Move(300);
  Expect("collision", 11,
         "Left arm hit the big counter at 0.22 s (0 of 3 stages by then); height of kitchen pot stayed at "
         "1.000 m, at "
         "least 1.1 m is needed.");
}

TEST_F(CauseFinderTest, AHandThatPressesOnTheSceneAndThenGraspsIsNoCause) {
  Move(10);
  contacts_ = {{kLeft, kCounter}};
  torque_[kLeft] = 80;
  Move(50);
  contacts_ = {};
  torque_[kLeft] = 2;
  EXPECT_EQ(Find().kind, "collision");
  HoldWithBoth();
  Move(300);
  EXPECT_EQ(Find().kind, "missed_condition");
}

TEST_F(CauseFinderTest, ALightTouchIsNoCollision) {
  contacts_ = {{kLeft, kCounter}};
  Move(300);
  contacts_ = {};
  torque_[kLeft] = 80;  // without contact
  Move(300);
  EXPECT_EQ(Find().kind, "missed_condition");
}

// The torque that carries the arm is unknown, because the arm touches the counter at every tick after the
// reset state, in which all torques are 0.
TEST_F(CauseFinderTest, AnArmThatAlwaysTouchesDoesNotPress) {
  for (const bool touches_at_reset : {true, false}) {
    dut_.Start();
    tick_ = -1;
    contacts_ = {};
    if (touches_at_reset) contacts_ = {{kLeft, kCounter}};
    torque_ = {0, 0};
    Tick();
    contacts_ = {{kLeft, kCounter}};
    torque_[kLeft] = -40;
    Move(300);
    EXPECT_EQ(Find().kind, "missed_condition") << Find().text;
  }
}

TEST_F(CauseFinderTest, WithoutTorquesALongTouchIsACollision) {
  torque_ = {};
  contacts_ = {{kLeft, kCounter}};
  Move(50);
  contacts_ = {};
  Move(250);
  EXPECT_EQ(Find().kind, "missed_condition");  // the contact lasts for only 0.98 s
  contacts_ = {{kRight, kCounter}};
  Move(51);
  contacts_ = {};
  Move(250);
  EXPECT_EQ(Find().kind, "collision");
  EXPECT_EQ(Find().tick, 301);
}

// Another arm pushes the pot into this hand.
TEST_F(CauseFinderTest, AHandAtRestPushesNothing) {
  Move(10);
  contacts_ = {{kRight, kPot}};
  Move(5);
  object_[0][1] = 0.03;
  wrist_[kRight][1] = 0.005;
  Move(5);
  contacts_ = {};
  Move(300);
  EXPECT_EQ(Find().kind, "missed_condition") << Find().text;
}

// The left arm, which moves, hits the right arm, which does not.
TEST_F(CauseFinderTest, TheArmThatMovesHitsTheOtherArm) {
  Move(10);
  for (int k = 0; k < 50; ++k) {
    joints_[kLeft] += 0.03;
    Tick();
  }
  contacts_ = {{kLeft, kRightArm}, {kRight, kLeftArm}};
  torque_ = {60, 60};
  for (int k = 0; k < 30; ++k) {
    joints_[kLeft] += 0.03;
    Tick();
  }
  contacts_ = {};
  torque_ = {2, 2};
  Move(300);
  // The contact begins at tick 61.
  Expect("collision", 61,
         "Left arm hit the right arm at 1.22 s (0 of 3 stages by then); height of kitchen pot stayed at "
         "1.000 m, "
         "at least 1.1 m is needed.");
}

TEST_F(CauseFinderTest, AStageThatIsReachedWhileArmsJamDoesNotExcuseThem) {
  Move(60);
  contacts_ = {{kLeft, kRightArm}, {kRight, kLeftArm}};
  torque_ = {60, 60};
  Move(20);
  touching_[kLeft] = 1;
  Move(1);
  touching_[kLeft] = 0;
  Move(10);
  contacts_ = {};
  torque_ = {2, 2};
  Move(300);
  EXPECT_EQ(Find().kind, "collision") << Find().text;
  EXPECT_EQ(Find().tick, 61);
}

TEST_F(CauseFinderTest, ArmsMayTouchOnlyIfTheyHoldTheSameObject) {
  for (const bool right_holds : {false, true}) {
    dut_.Start();
    tick_ = -1;
    torque_ = {2, 2};
    contacts_ = {};
    opening_ = {1, 1};
    touching_ = {0, 0};
    Tick();
    Move(60);
    opening_ = {0.4, right_holds ? 0.4 : 1};
    touching_ = {1, right_holds};
    Move(20);  // up to tick 80
    contacts_ = {{kLeft, kRightArm}, {kRight, kLeftArm}};
    torque_ = {60, 60};
    Move(30);
    contacts_ = {};
    torque_ = {2, 2};
    Move(300);
    EXPECT_EQ(Find().kind == "collision", !right_holds) << Find().text;
  }
}

// Another arm moves this one, which is at rest, and the pot with it.
TEST_F(CauseFinderTest, AHandThatIsPushedIntoTheObjectDoesNotPushIt) {
  commands_ = {0, 0};
  const auto move_left = [&](int ticks) {
    for (int k = 0; k < ticks; ++k) {
      joints_[kLeft] = commands_[kLeft] += 0.03;
      Tick();
    }
  };
  move_left(50);
  contacts_ = {{kRight, kPot}};
  move_left(5);
  object_[0][1] = wrist_[kRight][1] = 0.03;
  move_left(5);
  contacts_ = {};
  move_left(300);
  EXPECT_NE(Find().kind, "collision") << Find().text;
}

TEST_F(CauseFinderTest, AnArmThatShouldHoldTheObjectStops) {
  Move(20);
  for (int k = 0; k < 300; ++k) {
    joints_[kLeft] += 0.03;
    Tick();
  }
  // The right arm moved last at tick 20.
  EXPECT_EQ(Find().kind, "stall") << Find().text;
  EXPECT_EQ(Find().tick, 20);
  EXPECT_TRUE(Find().text.starts_with("Right arm stopped moving at 0.40 s (0 of 3 stages by then)"))
      << Find().text;
}

TEST_F(CauseFinderTest, AnArmThatShouldHoldTheObjectNeverMoves) {
  for (int k = 0; k < 300; ++k) {
    joints_[kLeft] += 0.03;
    Tick();
  }
  EXPECT_TRUE(Find().text.starts_with("Right arm never moved (0 of 3 stages)")) << Find().text;
}

TEST_F(CauseFinderTest, AnArmThatShouldPressOnTheObjectNeverMoves) {
  condition_t& touches = conditions_[kRight][0];
  touches.kind = condition_t::CONTACT;
  touches.predicate = "touching";
  touches.subject = "right_gripper";
  touches.other = "kitchen_pot";
  for (int k = 0; k < 300; ++k) {
    joints_[kLeft] += 0.03;
    Tick();
  }
  EXPECT_TRUE(Find().text.starts_with("Right arm never moved (0 of 3 stages)")) << Find().text;
}

// The policy's first command differs from the command in the reset state.
TEST_F(CauseFinderTest, ARobotWithOneCommandNeverMoved) {
  dut_.Start();
  tick_ = -1;
  commands_ = {0, 0};
  Tick();
  commands_ = {0.01, 0.01};
  Tick(300);
  EXPECT_TRUE(Find().text.starts_with("Robot never moved (0 of 3 stages)")) << Find().text;
}

TEST_F(CauseFinderTest, AnOpenHandPushesTheObject) {
  Move(10);
  contacts_ = {{kRight, kPot}};
  Move(5);
  object_[0][1] = wrist_[kRight][1] = 0.03;
  Move(5);
  contacts_ = {};
  Move(300);
  // The contact begins at tick 11, the push after tick 15.
  Expect("collision", 15,
         "Right arm hit the kitchen pot at 0.30 s and pushed it by 0.03 m (0 of 3 stages by then); height of "
         "kitchen "
         "pot stayed at 1.000 "
         "m, at least 1.1 m is needed.");
}

TEST_F(CauseFinderTest, TheRobotStops) {
  HoldWithBoth();
  Tick(300);
  Expect(
      "stall", 20,
      "Robot stopped moving at 0.40 s (2 of 3 stages by then); height of kitchen pot stayed at 1.000 m, at "
      "least "
      "1.1 m is "
      "needed.");
}

// The joints are at rest from tick 10. Both stages are reached when the grippers close.
TEST_F(CauseFinderTest, TheRobotStopsWhenItsGrippersHaveClosed) {
  closing_ = {0, 0};
  Move(10);
  Tick(20);
  closing_ = {1, 1};
  opening_ = {0.4, 0.4};
  touching_ = {1, 1};
  Tick(300);
  Expect(
      "stall", 31,
      "Robot stopped moving at 0.62 s (2 of 3 stages by then); height of kitchen pot stayed at 1.000 m, at "
      "least 1.1 m is needed.");
}

// The last progress is in the last fifth of the episode, but the robot is at rest for the last 2.6 s.
TEST_F(CauseFinderTest, ARobotAtRestHasNotRunOutOfTime) {
  HoldWithBoth();
  Move(700);
  for (int k = 0; k < 130; ++k) {
    object_[0][2] += 0.0004;
    Move(1);
  }
  Tick(130);
  EXPECT_EQ(Find().kind, "missed_condition");
  EXPECT_NEAR(static_cast<double>(Find().tick), 850, 5);
}

TEST_F(CauseFinderTest, ARobotThatSagsUnderALoadHasStopped) {
  commands_ = {0, 0};
  Move(3);
  HoldWithBoth();  // up to tick 23, which is the last tick with these commands
  commands_ = {0.33, 0};
  Tick();
  for (int k = 0; k < 300; ++k) {
    joints_[0] -= 0.001;  // 0.05 rad/s
    Tick();
  }
  EXPECT_EQ(Find().kind, "stall");
  EXPECT_EQ(Find().tick, 24);
}

TEST_F(CauseFinderTest, ARobotThatDoesNotReachWhatItIsCommandedHasNotStopped) {
  HoldWithBoth();
  commands_ = joints_;
  for (int k = 0; k < 300; ++k) {
    commands_[0] += 0.001;
    Tick();
  }
  EXPECT_NE(Find().kind, "stall");
}

TEST_F(CauseFinderTest, AStopLongAfterTheLastProgressIsNotTheCause) {
  HoldWithBoth();
  Move(100);
  Tick(300);
  Expect("missed_condition", 11,
         "Last progress at 0.22 s (2 of 3 stages by then); height of kitchen pot stayed at 1.000 m, at least "
         "1.1 m is "
         "needed.");
}

TEST_F(CauseFinderTest, TimeRunsOut) {
  HoldWithBoth();
  for (int k = 0; k < 200; ++k) {
    object_[0][2] += 0.0004;
    Move(1);
  }
  Expect("out_of_time", 220,
         "Time ran out at 4.40 s (2 of 3 stages by then); height of kitchen pot reached 1.080 m, at least "
         "1.1 m is "
         "needed.");
}

TEST_F(CauseFinderTest, ASlowRobotRunsOutOfTime) {
  commands_ = {0, 0};
  for (int k = 0; k < 300; ++k) {
    for (double& command : commands_) command += 0.0049;  // 0.245 rad/s
    Move(1);
  }
  Expect("out_of_time", 300,
         "No progress until time ran out at 6.00 s (0 of 3 stages by then); height of kitchen pot stayed at "
         "1.000 m, "
         "at least 1.1 m is needed.");
  commands_[1] += 0.0051;
  Move(1);
  EXPECT_EQ(Find().kind, "missed_condition");
}

// A source's data may end long before the time limit.
TEST_F(CauseFinderTest, DataThatEndIsNoTimeLimit) {
  HoldWithBoth();
  for (int k = 0; k < 200; ++k) {
    object_[0][2] += 0.0004;
    Move(1);
  }
  const cause_t cause = Find(CauseEnd::By::kTime, end_reason::kEndOfData);
  EXPECT_EQ(cause.kind, "out_of_time");
  EXPECT_TRUE(cause.text.starts_with("The data ended at 4.40 s (2 of 3 stages by then); ")) << cause.text;
}

TEST_F(CauseFinderTest, ARobotThatRestsWithoutProgressMissesACondition) {
  Move(100);
  Tick(200);
  Expect("missed_condition", 0,
         "No progress (0 of 3 stages); height of kitchen pot stayed at 1.000 m, at least 1.1 m is needed.");
  EXPECT_EQ(Reason(), "timeout");
}

TEST_F(CauseFinderTest, AValueIsNotRoundedToItsLimit) {
  HoldWithBoth();
  object_[0][2] = 1.09996;
  Move(300);
  EXPECT_NE(Find().text.find("reached 1.09996 m, at least 1.1 m is needed"), std::string::npos)
      << Find().text;
}

// The stage was reached, so the largest value alone does not explain the failure.
TEST_F(CauseFinderTest, AValueThatWasReachedAndLostHasBothValues) {
  HoldWithBoth();
  object_[0][2] = 1.12;
  Move(5);
  object_[0][2] = 1.15;
  Move(5);  // up to tick 30
  object_[0][2] = 1.05;
  Move(300);
  Expect(
      "missed_condition", 30,
      "Progress was undone at 0.60 s (3 of 3 stages by then); height of kitchen pot reached 1.150 m and was "
      "1.050 m at the end, at least 1.1 m is needed.");
}

TEST_F(CauseFinderTest, AnErrorOfThePolicyIsItsOwnCause) {
  HoldWithBoth();
  touching_[kLeft] = 0;
  Move(50);
  const cause_t cause = Find(CauseEnd::By::kOther, "policy_error", "out of\nmemory");
  EXPECT_EQ(cause.kind, "policy_error");
  EXPECT_EQ(cause.tick, 70);
  EXPECT_EQ(cause.text, "Policy error at 1.40 s: out of?memory (2 of 3 stages by then).");
  EXPECT_EQ(Reason(CauseEnd::By::kOther, "policy_error"), "policy_error");
}

TEST_F(CauseFinderTest, AFailureConditionDecidesWithoutAnEvent) {
  Move(100);
  condition_t floor{};
  floor.text = "kitchen_pot touches world";
  const cause_t cause = dut_.Find({.by = CauseEnd::By::kFailure,
                                   .reason = "failure_condition",
                                   .detail = {},
                                   .last_tick = tick_,
                                   .conditions = {floor}})
                            .cause;
  EXPECT_EQ(Reason(CauseEnd::By::kFailure, "failure_condition"), "failure_condition");
  EXPECT_EQ(cause.kind, "failed_condition");
  EXPECT_EQ(cause.text, "Failure at 2.00 s: kitchen pot touches world (0 of 3 stages by then).");
}

// The condition that must last is named first, and the duration only once the condition is met.
TEST_F(CauseFinderTest, AConditionLacksBeforeItsDuration) {
  condition_t lasts{};
  lasts.predicate = "lasts";
  lasts.has_value = true;
  lasts.comparison = ">=";
  lasts.threshold_mixed = 7;
  lasts.text = "for 7 s or longer: height of kitchen_pot at least 1.1 m";
  conditions_[3] = {Height(), Holding("left"), lasts};
  object_[0][2] = 1.2;
  Move(300);
  EXPECT_TRUE(Find().text.ends_with("; condition not met: left gripper touches kitchen pot.")) << Find().text;
  conditions_[3][1].holds = true;
  Move(1);
  EXPECT_TRUE(
      Find().text.ends_with("; condition not met: for 7 s or longer: height of kitchen pot at least 1.1 m."))
      << Find().text;
}

TEST_F(CauseFinderTest, ASuccessHasItsNumbers) {
  Move(50);
  condition_t height = Height(), apart{};
  height.text = "height of kitchen_pot 1.099 m >= 1.096";
  apart.text = "kitchen_pot does not touch counter";
  const cause_t cause = dut_.Find({.by = CauseEnd::By::kSuccess,
                                   .reason = {},
                                   .detail = {},
                                   .last_tick = tick_,
                                   .conditions = {apart, height}})
                            .cause;
  EXPECT_EQ(cause.kind, "success");
  EXPECT_EQ(cause.text, "Success at 1.00 s: height of kitchen pot 1.099 m.");
  // A duration is stated together with its condition.
  condition_t lasts{};
  lasts.predicate = "lasts";
  lasts.has_value = true;
  lasts.text = "true for 1 s >= 1 s";
  const std::string text = dut_.Find({.by = CauseEnd::By::kSuccess,
                                      .reason = {},
                                      .detail = {},
                                      .last_tick = tick_,
                                      .conditions = {apart, lasts}})
                               .cause.text;
  EXPECT_EQ(text, "Success at 1.00 s: kitchen pot does not touch counter, true for 1 s.");
}

}  // namespace evalbus::metrics::cause_finder_test
