// Tests predicates about joints, places and handovers in handwritten worlds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <numbers>
#include <regex>
#include <set>

#include "base/errors.h"
#include "metrics/task/task_evaluator.h"
#include "tests/unit/set_array.h"
#include "tests/unit/small_world.h"

namespace evalbus::metrics::predicates_test {

using namespace small_world;

// Returns the small world with two joints: pot/wheel, without limits, at index 0 of qpos, and pot/lid_hinge,
// from -2 to 3 rad, at index 1.
model_info_t ModelWithJoints() {
  model_info_t model = Model();
  model.joint_name = {"pot/lid_hinge", "pot/wheel"};
  model.joint_qpos_index = {1, 0};
  model.joint_lower_mixed = {-2, 0};
  model.joint_upper_mixed = {3, 0};
  model.num_joints = 2;
  return model;
}

class PredicatesTest : public testing::Test {
 protected:
  PredicatesTest() {
    state_.qpos_mixed = {0, 0};
    state_.num_qpos = 2;
  }
  // Compiles this success condition in a task that is otherwise unchanged.
  std::unique_ptr<Predicate> Compile(const std::string& condition) {
    std::string text = kTask;
    const size_t begin = text.find("success:"), end = text.find("failure:");
    text.replace(begin, end - begin, "success: " + condition + "\n");
    task_ = ParseTask(text, "t.yaml", false);
    return CompilePredicate(task_.success, {names_, task_});
  }
  std::string ErrorWithLine(const std::string& condition) {
    try {
      Compile(condition);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  std::string Error(const std::string& condition) {
    const std::string message = ErrorWithLine(condition);
    const size_t colon = message.find(": ");
    return colon == std::string::npos ? message : message.substr(colon + 2);
  }
  static int LineOfSuccess() {
    const std::string text = kTask;
    return 1 + static_cast<int>(
                   std::count(text.begin(), text.begin() + static_cast<long>(text.find("success:")), '\n'));
  }
  bool Evaluate(Predicate* predicate, const std::vector<std::pair<int, int>>& pairs = {}) {
    contacts_ = Contacts(1, pairs);
    return predicate->Evaluate({state_, contacts_.contact});
  }
  bool At(const std::string& condition, double coordinate) {
    state_.qpos_mixed[1] = coordinate;
    return Evaluate(Compile(condition).get());
  }

  const model_info_t model_ = ModelWithJoints();
  const ModelNames names_{model_};
  TaskDescription task_;
  state_t state_ = State(1);
  contacts_t contacts_{};
};

TEST_F(PredicatesTest, JointFractionIsOfTheRangeFromItsLowerEnd) {
  // A fraction of 0.1 of the range is at -2 + 0.5.
  const std::string turned = "{joint_fraction: {joint: pot/lid_hinge, min: 0.1}}";
  EXPECT_FALSE(At(turned, -1.51));
  EXPECT_TRUE(At(turned, -1.49));
  const std::string closed = "{joint_fraction: {joint: pot/lid_hinge, max: 0.1}}";
  EXPECT_TRUE(At(closed, -1.51));
  EXPECT_FALSE(At(closed, -1.49));
  const std::string middle = "{joint_fraction: {joint: pot/lid_hinge, min: 0.4, max: 0.6}}";
  EXPECT_FALSE(At(middle, -0.01));
  EXPECT_TRUE(At(middle, 0.5));
  EXPECT_FALSE(At(middle, 1.01));
  state_.qpos_mixed[1] = 2;
  const Expression quantity = ReadExpression(ParseYaml("joint_fraction: {joint: pot/lid_hinge}", "t.yaml"));
  EXPECT_DOUBLE_EQ(CompileQuantity(quantity, {names_, task_})->Evaluate({state_, {}}), 0.8);

  EXPECT_EQ(Error("{joint_fraction: {joint: pot/lid_hinge}}"),
            "'joint_fraction' requires 'min', 'max' or both");
  EXPECT_EQ(Error("{joint_fraction: {joint: pot/hinge, min: 0}}"),
            "no joint has the name 'pot/hinge'; expected pot/lid_hinge, pot/wheel");
  EXPECT_EQ(Error("{joint_fraction: {joint: pot/wheel, min: 0}}"),
            "joint 'pot/wheel' has no range, but this quantity requires one");
}

TEST_F(PredicatesTest, PositionLimitsOneCoordinate) {
  Set(&state_.body[kPot].position_m, {0.5, -0.2, 1});
  EXPECT_TRUE(Evaluate(Compile("{position: {object: pot, axis: y, max_m: -0.2}}").get()));
  EXPECT_FALSE(Evaluate(Compile("{position: {object: pot, axis: y, max_m: -0.21}}").get()));
  EXPECT_TRUE(Evaluate(Compile("{position: {object: pot, axis: x, min_m: 0.4, max_m: 0.6}}").get()));
  EXPECT_FALSE(Evaluate(Compile("{position: {object: pot, axis: z, min_m: 1.1}}").get()));
  EXPECT_EQ(Error("{position: {object: pot, axis: up, min_m: 0}}"),
            "key 'axis': expected x, y or z, got 'up'");
  EXPECT_EQ(Error("{position: {object: pot, axis: x}}"), "'position' requires 'min_m', 'max_m' or both");
}

TEST_F(PredicatesTest, InsideIsABoxOfTheWorld) {
  const auto box = Compile("{inside: {object: pot, center_m: [0.5, 0, 1], half_extents_m: [0.1, 0.2, 0.3]}}");
  Set(&state_.body[kPot].position_m, {0.59, -0.19, 1.29});
  EXPECT_TRUE(Evaluate(box.get()));
  for (const std::array<double, 3>& outside :
       {std::array<double, 3>{0.61, 0, 1}, {0.39, 0, 1}, {0.5, 0.21, 1}, {0.5, -0.21, 1}, {0.5, 0, 1.31}}) {
    Set(&state_.body[kPot].position_m, outside);
    EXPECT_FALSE(Evaluate(box.get())) << outside[0] << " " << outside[1] << " " << outside[2];
  }
  EXPECT_EQ(box->Describe(true),
            std::vector<std::string>{"pot inside the box of 0.2 x 0.4 x 0.6 m around (0.5, 0, 1) m"});
  const auto words = [&](const std::array<double, 3>& position) {
    Set(&state_.body[kPot].position_m, position);
    Evaluate(box.get());
    std::vector<condition_t> conditions;
    box->Explain(&conditions);
    EXPECT_EQ(conditions.at(0).threshold_mixed, 0);
    return conditions.at(0).text;
  };
  EXPECT_EQ(words({0.58, 0, 1}), "pot inside its box, by 0.02 m");
  EXPECT_EQ(words({0.5, 0, 1.35}), "pot outside its box, by 0.05 m");
  EXPECT_EQ(Error("{inside: {object: pot, center_m: [0.5, 0], half_extents_m: [1, 1, 1]}}"),
            "key 'center_m': expected a list of 3 numbers, got 2");
}

TEST_F(PredicatesTest, AFrameMovesWithItsPart) {
  // The lid's frame is at (1, 2, 3), rotated by a quarter turn to the left and then by 30 degrees about its
  // own x axis. A point that is a to its left and b above it is at (1, 2, 3) + R (0, a, b).
  const double turn = std::numbers::pi / 6, c = std::cos(turn), s = std::sin(turn);
  const double h = std::sqrt(0.5), ch = std::cos(turn / 2), sh = std::sin(turn / 2);
  Set(&state_.body[kLid].position_m, {1, 2, 3});
  Set(&state_.body[kLid].quat_wxyz, {h * ch, h * sh, h * sh, h * ch});
  const double a = 0.2, b = 0.5;
  // The quarter turn maps the tilted vector (0, a c - b s, a s + b c) to (-(a c - b s), 0, a s + b c).
  Set(&state_.body[kPot].position_m, {1 - (a * c - b * s), 2, 3 + a * s + b * c});
  const auto coordinate = [&](const char* axis) {
    const std::string text = std::string("position: {object: pot, axis: ") + axis + ", frame: pot/lid}";
    return CompileQuantity(ReadExpression(ParseYaml(text, "t.yaml")), {names_, task_})
        ->Evaluate({state_, {}});
  };
  EXPECT_NEAR(coordinate("x"), 0, 1e-12);
  EXPECT_NEAR(coordinate("y"), a, 1e-12);
  EXPECT_NEAR(coordinate("z"), b, 1e-12);
  EXPECT_TRUE(Evaluate(Compile("{position: {object: pot, axis: z, min_m: 0.49, frame: pot/lid}}").get()));
  const auto in_lid = [&](const char* half_extents) {
    return Evaluate(Compile(std::string("{inside: {object: pot, frame: pot/lid, center_m: [0, 0.2, 0.4], ") +
                            "half_extents_m: " + half_extents + "}}")
                        .get());
  };
  EXPECT_EQ(
      Compile("{inside: {object: pot, frame: pot/lid, center_m: [0, 0.2, 0.4], half_extents_m: [0.01, 0.01, "
              "0.11]}}")
          ->Describe(false),
      std::vector<std::string>{
          "pot not inside the box of 0.02 x 0.02 x 0.22 m around (0, 0.2, 0.4) m in the frame of pot/lid"});
  EXPECT_TRUE(in_lid("[0.01, 0.01, 0.11]"));
  EXPECT_FALSE(in_lid("[0.01, 0.01, 0.09]"));
  EXPECT_EQ(
      Error("{inside: {object: pot, center_m: [0, 0, 0], half_extents_m: [1, 1, 1], frame: lid}}"),
      "no entity or body has the name 'lid'; expected an entity (counter, left, pot, right, world) or a body "
      "(counter/counter, left/base, left/hand, pot/lid, pot/pot, right/base, right/hand, world)");
}

TEST_F(PredicatesTest, AQuantityWithLimitsIsAPredicate) {
  Set(&state_.body[kPot].position_m, {0, 0, 1});
  Set(&state_.body[kLid].position_m, {0.3, 0.4, 1});
  EXPECT_TRUE(Evaluate(Compile("{distance: {a: pot, b: pot/lid, max_m: 0.501}}").get()));
  EXPECT_FALSE(Evaluate(Compile("{distance: {a: pot, b: pot/lid, max_m: 0.499}}").get()));
  EXPECT_TRUE(Evaluate(Compile("{distance: {a: pot, b: pot/lid, min_m: 0.4, max_m: 0.6}}").get()));
  // The lid's x axis points along y. The point is 0.4 m before the origin of the lid's frame; it is at (0.3,
  // 0, 1) in the world.
  Set(&state_.body[kLid].quat_wxyz, {std::sqrt(0.5), 0, 0, std::sqrt(0.5)});
  EXPECT_TRUE(
      Evaluate(Compile("{distance: {a: pot, b: pot/lid, b_point_m: [-0.4, 0, 0], max_m: 0.301}}").get()));
  EXPECT_FALSE(
      Evaluate(Compile("{distance: {a: pot, b: pot/lid, b_point_m: [-0.4, 0, 0], max_m: 0.299}}").get()));
  EXPECT_EQ(Error("{distance: {a: pot, b: left, b_point_m: [0, 0, 0], max_m: 1}}"),
            "key 'b_point_m': requires a body as 'b'; 'left' is a gripper");
  EXPECT_TRUE(Evaluate(Compile("{tilt: {object: pot, max_deg: 10}}").get()));
  // 0.2 rad are 11.46 degrees.
  Set(&state_.body[kPot].quat_wxyz, {std::cos(0.1), std::sin(0.1), 0, 0});
  EXPECT_FALSE(Evaluate(Compile("{tilt: {object: pot, max_deg: 11.4}}").get()));
  EXPECT_TRUE(Evaluate(Compile("{tilt: {object: pot, max_deg: 11.5}}").get()));
  EXPECT_TRUE(Evaluate(Compile("{tilt: {object: pot, max_rad: 0.2001}}").get()));
  EXPECT_FALSE(Evaluate(Compile("{tilt: {object: pot, max_rad: 0.1999}}").get()));
  const auto near = Compile("{distance: {a: pot, b: pot/lid, max_m: 0.25}}");
  Evaluate(near.get());
  std::vector<condition_t> why;
  near->Explain(&why);
  EXPECT_EQ(why[0].text, "distance of pot from pot/lid 0.500 m > 0.25");
  EXPECT_EQ(why[0].subject, "pot");
  EXPECT_EQ(near->Describe(true), std::vector<std::string>{"distance of pot from pot/lid at most 0.25 m"});
}

TEST_F(PredicatesTest, SpeedIsFromTickToTick) {
  const auto slow = Compile("{speed: {object: pot, max_mps: 0.1}}");
  const auto at = [&](int64_t tick, double x) {
    state_.header = Header(tick);
    Set(&state_.body[kPot].position_m, {x, 0, 1});
    return slow->Evaluate({state_, {}});
  };
  EXPECT_TRUE(at(1, 0.7)) << "nothing moves at the first tick";
  // Ticks are 20 ms apart, and the pot moves by 1.9 and 2.1 mm.
  EXPECT_TRUE(at(2, 0.7019));
  EXPECT_FALSE(at(3, 0.6998));
  // One tick is missing.
  EXPECT_TRUE(at(5, 0.7037));
  slow->Start();
  EXPECT_TRUE(at(1, 9)) << "the episode before is forgotten";
}

TEST_F(PredicatesTest, ARobotAtRestHasNoFastJoint) {
  const auto left = Compile("{joint_speed: {arm: left, max_radps: 0.05}}");
  const auto all = Compile("{joint_speed: {arm: all, max_radps: 0.05}}");
  EXPECT_TRUE(Evaluate(all.get()));
  state_.arm[1].joint_velocity_radps = {-0.06};
  EXPECT_TRUE(Evaluate(left.get()));
  EXPECT_FALSE(Evaluate(all.get()));
  EXPECT_EQ(Error("{joint_speed: {arm: lift, max_radps: 0.05}}"),
            "key 'arm': there is no arm 'lift'; did you mean 'left'?");
}

TEST_F(PredicatesTest, OnIsCarriedFromBelow) {
  const auto on = Compile("{on: {object: pot, support: counter}}");
  const auto with_normal = [&](int geom_a, int geom_b, std::array<double, 3> normal) {
    contacts_ = Contacts(1, {{geom_a, geom_b}});
    std::copy(normal.begin(), normal.end(), contacts_.contact[0].normal);
    return on->Evaluate({state_, contacts_.contact});
  };
  // The normal points from the first geom to the second.
  EXPECT_TRUE(with_normal(kTop, kWall, {0, 0, 1}));
  EXPECT_TRUE(with_normal(kTop, kLidGeom, {0, 0, 1}));
  EXPECT_FALSE(with_normal(kTop, kWall, {0, 0, -1})) << "hangs below";
  EXPECT_FALSE(with_normal(kTop, kWall, {1, 0, 0})) << "leans against its side";
  EXPECT_FALSE(with_normal(kFloor, kWall, {0, 0, 1}));
  const double c44 = std::cos(44 * std::numbers::pi / 180), s44 = std::sin(44 * std::numbers::pi / 180);
  EXPECT_TRUE(with_normal(kTop, kWall, {s44, 0, c44}));
  EXPECT_FALSE(with_normal(kTop, kWall, {c44, 0, s44}));
  const auto lid_on_wall = Compile("{on: {object: counter/top, support: pot/wall}}");
  contacts_ = Contacts(1, {{kTop, kWall}});
  contacts_.contact[0].normal[2] = -1;
  EXPECT_TRUE(lid_on_wall->Evaluate({state_, contacts_.contact}));
}

TEST_F(PredicatesTest, LastsCountsTimeWithoutABreak) {
  const auto dut = Compile("{lasts: {min_s: 0.1, when: {touching: {a: pot, b: counter}}}}");
  const auto at = [&](int64_t tick, bool touches) {
    state_.header = Header(tick);
    if (touches) return dut->Evaluate({state_, Contacts(tick).contact});
    return dut->Evaluate({state_, {}});
  };
  // The condition must be true for five ticks of 20 ms after the first.
  for (int64_t tick = 1; tick <= 5; ++tick) EXPECT_FALSE(at(tick, true)) << tick;
  std::vector<condition_t> why;
  dut->Explain(&why);
  ASSERT_EQ(why.size(), 2u);
  EXPECT_EQ(why[0].text, "pot touches counter");
  EXPECT_EQ(why[1].text, "true for 0.08 s < 0.1 s");
  EXPECT_FALSE(why[1].holds);
  EXPECT_TRUE(at(6, true));
  EXPECT_FALSE(at(7, false));
  why.clear();
  dut->Explain(&why);
  ASSERT_EQ(why.size(), 1u);
  EXPECT_EQ(why[0].text, "pot does not touch counter");
  EXPECT_FALSE(at(8, true));
  dut->Start();
  EXPECT_FALSE(at(13, true)) << "the episode before is forgotten";
  EXPECT_EQ(dut->Describe(true), (std::vector<std::string>{"for 0.1 s or longer", "  pot touches counter"}));
  EXPECT_EQ(Error("{lasts: {min_s: 1}}"),
            "'lasts' requires predicates, as in lasts: {min_s: 1, when: {touching: {a: pot, b: world}}}");
  EXPECT_EQ(
      Error("{lasts: {min_s: 1, touching: {a: pot, b: counter}}}"),
      "key 'touching': expected a value, got a map; a predicate in 'lasts' is written as when: {touching: "
      "{...}}");
  EXPECT_EQ(Error("{lasts: {when: {touching: {a: pot, b: counter}}}}"),
            "key 'min_s': required here, but missing in 'lasts'");
  EXPECT_EQ(Error("{touching: {a: pot, b: counter, when: {touching: {a: pot, b: counter}}}}"),
            "'touching' takes arguments, not other expressions");
}

TEST_F(PredicatesTest, TheDocumentationListsAll) {
  std::set<std::string> predicates, quantities;
  std::set<std::string>* table = nullptr;
  std::ifstream page(EVALBUS_SOURCE_DIR "/docs/metrics.md");
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("| predicate |")) table = &predicates;
    if (line.starts_with("| quantity |")) table = &quantities;
    if (!line.starts_with("|")) table = nullptr;
    if (!table) continue;
    const std::string cell = line.substr(0, line.find(" | "));
    const std::regex name("`(\\w+): ");
    for (std::sregex_iterator i(cell.begin(), cell.end(), name), end; i != end; ++i) table->insert((*i)[1]);
  }
  const std::vector<std::string> known_quantities = QuantityNames(), known_predicates = PredicateNames();
  EXPECT_EQ(quantities, std::set<std::string>(known_quantities.begin(), known_quantities.end()));
  // Every quantity is also a predicate.
  predicates.merge(quantities);
  EXPECT_EQ(predicates, std::set<std::string>(known_predicates.begin(), known_predicates.end()));
}

TEST_F(PredicatesTest, NumbersAreReadAsEverywhereInTheFile) {
  // Each number is on a separate line, as the key of a block.
  const auto read = [&](const std::string& number) {
    const std::string message = ErrorWithLine("\n  height_above:\n    object: pot\n    min_m: " + number);
    return message;
  };
  const std::string where =
      "t.yaml:" + std::to_string(LineOfSuccess() + 3) + ": key 'min_m': expected a number, got ";
  for (const char* wrong : {"0x10", "0X1p3", "nan", "inf", "-inf", ".inf", "infinity", "1,5", "1e", "1e400",
                            "1.2.3", "1_0", "one", "1 2", "--1", "+-1", "1f"}) {
    EXPECT_EQ(read(wrong), where + "'" + wrong + "'");
  }
  // A quoted value is text.
  EXPECT_EQ(read("'1e3 '"), where + "'1e3 '");
  EXPECT_EQ(read("'1'"), where + "'1'");
  EXPECT_EQ(read("[1]"), where + "a list");
  for (const char* right : {"1e3 ", "1.1", "-9", "+9", ".5", "5.", "1E-3", "0"})
    EXPECT_EQ(read(right), "accepted") << right;
  // An element of a list is named by its index.
  EXPECT_EQ(Error("{inside: {object: pot, center_m: [0.5, 0x10, 0], half_extents_m: [1, 1, 1]}}"),
            "key 'center_m[1]': expected a number, got '0x10'");
  EXPECT_EQ(Error("{tilt_below: {object: pot, max_deg: 0x10}}"),
            "key 'max_deg': expected a number in [0, 90], got '0x10'");
  EXPECT_EQ(Error("{tilt_below: {object: pot, max_deg: 1, max_rad: 1}}"),
            "key 'max_rad': give either this or 'max_deg'");
}

TEST_F(PredicatesTest, ALimitInDegreesIsTheNumberThatIsWritten) {
  // 60 degrees converted to radians and back are 59.99999999999999.
  const auto dut = Compile("{tilt_below: {object: pot, max_deg: 60}}");
  Evaluate(dut.get());
  std::vector<condition_t> why;
  dut->Explain(&why);
  EXPECT_EQ(why[0].threshold_mixed, 60);
}

TEST_F(PredicatesTest, FirstAndOtherGripperKeepTheirRolesForAnEpisode) {
  const auto first = Compile("{holding: {gripper: first, object: pot}}");
  const auto other = Compile("{holding: {gripper: other, object: pot}}");
  const auto evaluate = [&](const std::vector<std::pair<int, int>>& pairs) {
    const bool is_first = Evaluate(first.get(), pairs);
    return std::pair(is_first, Evaluate(other.get(), pairs));
  };
  using Pair = std::pair<bool, bool>;
  EXPECT_EQ(evaluate({}), Pair(false, false));
  EXPECT_EQ(evaluate({{kRightPad, kWall}}), Pair(true, false));
  EXPECT_EQ(evaluate({{kRightPad, kWall}, {kLeftPad, kWall}}), Pair(true, true));
  EXPECT_EQ(evaluate({{kLeftPad, kWall}}), Pair(false, true));
  EXPECT_EQ(evaluate({}), Pair(false, false));
  EXPECT_EQ(evaluate({{kLeftPad, kWall}}), Pair(false, true));
  // In the next episode, the left gripper touches the pot first.
  first->Start();
  other->Start();
  EXPECT_EQ(evaluate({{kLeftPad, kWall}}), Pair(true, false));
  // If both touch at the same tick, the model's first gripper counts as the first.
  first->Start();
  other->Start();
  EXPECT_EQ(evaluate({{kRightPad, kWall}, {kLeftPad, kWall}}), Pair(true, true));
  EXPECT_EQ(evaluate({{kLeftPad, kWall}}), Pair(true, false));
}

TEST_F(PredicatesTest, GrippersCanTouch) {
  const auto touching = Compile("{touching: {a: left_gripper, b: pot/lid}}");
  EXPECT_TRUE(Evaluate(touching.get(), {{kLeftPad, kLidGeom}}));
  EXPECT_FALSE(Evaluate(touching.get(), {{kLeftLink, kLidGeom}}));
  EXPECT_FALSE(Evaluate(touching.get(), {{kRightPad, kLidGeom}}));
  EXPECT_FALSE(Evaluate(touching.get(), {{kLeftPad, kWall}}));
  EXPECT_NE(Error("{touching: {a: hand, b: pot}}").find("a gripper (left_gripper, right_gripper)"),
            std::string::npos);
}

TEST_F(PredicatesTest, RefusesWhatCanNeverHold) {
  EXPECT_EQ(Error("{tilt_below: {object: pot, max_deg: 90}}"), "accepted");
  EXPECT_EQ(Error("{tilt_below: {object: pot, max_deg: 91}}"),
            "key 'max_deg': expected a number in [0, 90], got '91'");
  EXPECT_EQ(Error("{joint_fraction: {joint: pot/lid_hinge, max: 5}}"),
            "key 'max': expected a number in [0, 1], got '5'");
  EXPECT_EQ(Error("{joint_fraction: {joint: pot/lid_hinge, min: 0.6, max: 0.4}}"),
            "'joint_fraction' is never true: 'min' is above 'max'");
  EXPECT_EQ(Error("{distance: {a: pot, b: counter, max_m: -0.1}}"),
            "key 'max_m': expected a number >= 0, got '-0.1'");
  EXPECT_EQ(Error("{inside: {object: pot, center_m: [0, 0, 0], half_extents_m: [0.1, -0.1, 0.1]}}"),
            "key 'half_extents_m[1]': expected a number >= 0, got '-0.1'");
  EXPECT_EQ(Error("{touching: {a: pot, b: pot}}"), "key 'b': expected something other than 'a'");
  EXPECT_EQ(Error("{on: {object: pot, support: pot}}"),
            "key 'support': expected something other than 'object'");
  EXPECT_EQ(Error("{distance: {a: pot, b: pot, min_m: 0.1}}"), "key 'b': expected something other than 'a'");
  EXPECT_EQ(Error("{distance: {a: pot, b: pot, b_point_m: [0, 0, 1], min_m: 0.1}}"), "accepted");
  EXPECT_EQ(Error("{lasts: {min_s: 6, when: {touching: {a: pot, b: counter}}}}"),
            "key 'min_s': expected a number in [0, 5], got '6'");
  model_info_t one_gripper = ModelWithJoints();
  one_gripper.gripper.pop_back();
  one_gripper.num_grippers = 1;
  EXPECT_EQ(Compile("{holding: {gripper: other, object: pot}}")->Describe(false),
            std::vector<std::string>{"the other gripper does not touch pot"});
  try {
    CompilePredicate(task_.success, {ModelNames(one_gripper), task_});
    FAIL() << "must throw";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("gripper 'other' requires a robot with two grippers"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(PredicatesTest, CombinationsRefuseArgumentsThatTheyDoNotHave) {
  const std::string touching = "when: {touching: {a: pot, b: counter}}}";
  for (const std::string name : {"all", "any", "not", "latched"}) {
    EXPECT_EQ(Error("{" + name + ": {" + touching + "}"), "accepted") << name;
    EXPECT_TRUE(
        Error("{" + name + ": {min_s: 1, " + touching + "}").starts_with("key 'min_s': unknown key here"))
        << name;
  }
  EXPECT_EQ(Error("{lasts: {min_s: 1, " + touching + "}"), "accepted");
}

TEST_F(PredicatesTest, RefuseContactsOfBodiesWithoutGeoms) {
  model_info_t model = ModelWithJoints();
  model.geom_body[kLidGeom] = kPot;  // the lid has no other geom
  for (const auto& [condition, key] :
       {std::pair<std::string, std::string>{"{touching: {a: counter, b: pot/lid}}", "b"},
        {"{on: {object: pot/lid, support: counter}}", "object"},
        {"{holding: {gripper: left, object: pot/lid}}", "object"}}) {
    EXPECT_EQ(Error(condition), "accepted") << "in the model whose lid has a geom";
    try {
      CompilePredicate(task_.success, {ModelNames(model), task_});
      FAIL() << condition << " must throw";
    } catch (const InputError& error) {
      EXPECT_TRUE(std::string(error.what())
                      .ends_with(": key '" + key +
                                 "': 'pot/lid' has no geom that collides, so it never touches anything"))
          << error.what();
    }
  }
}

TEST_F(PredicatesTest, DescribeThemselvesInWords) {
  using Lines = std::vector<std::string>;
  const auto all = Compile(
      "{all: [{not: {touching: {a: pot, b: counter}}}, {height_above: {object: pot, min_m: 1.1}},"
      " {any: [{holding: {gripper: other, object: pot}}, {joint_fraction: {joint: pot/lid_hinge, max: "
      "0.1}}]}]}");
  EXPECT_EQ(
      all->Describe(true),
      (Lines{"all of", "  pot does not touch counter", "  height of pot at least 1.1 m", "  any of",
             "    the other gripper touches pot", "    fraction of the range of pot/lid_hinge at most 0.1"}));
  EXPECT_EQ(Compile("{not: {position: {object: pot, axis: x, min_m: 0, max_m: 1}}}")->Describe(true),
            (Lines{"x of pot not between 0 and 1 m"}));
  EXPECT_EQ(Compile("{latched: {touching: {a: pot, b: counter}}}")->Describe(true),
            (Lines{"at any time so far", "  pot touches counter"}));
}

// This test is the last one, because its quantities stay registered.
TEST_F(PredicatesTest, ReportWhatAPluginReturns) {
  class Odd : public Quantity {
   public:
    Odd() { words_ = "odd number"; }
    double Evaluate(const WorldView&) override { return std::numeric_limits<double>::quiet_NaN(); }
  };
  QuantityKind kind{.name = "odd",
                    .required_arguments = {},
                    .optional_arguments = {},
                    .key = "m",
                    .unit = "m",
                    .range = {},
                    .kind = condition_t::POSE,
                    .make = {}};
  kind.make = [](const YamlMap&, const CompileContext&) { return std::make_unique<Odd>(); };
  RegisterQuantity(kind);
  try {
    Evaluate(Compile("{not: {odd: {max_m: 1}}}").get());
    FAIL() << "must throw";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "odd number is NaN at tick 1");
  }
  kind.name = "missing";
  kind.make = [](const YamlMap&, const CompileContext&) { return std::unique_ptr<Quantity>(); };
  RegisterQuantity(kind);
  EXPECT_EQ(ErrorWithLine("{missing: {max_m: 1}}"), "quantity 'missing': its plugin returned none");
  RegisterPredicate("absent", [](const Expression&, const CompileContext&) { return nullptr; });
  EXPECT_EQ(ErrorWithLine("{absent: {}}"), "predicate 'absent': its plugin returned none");
}

}  // namespace evalbus::metrics::predicates_test
