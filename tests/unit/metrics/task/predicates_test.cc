// Predicates about joints, places and handovers, on hand-made worlds.
#include <gtest/gtest.h>

#include <algorithm>

#include "base/errors.h"
#include "metrics/task/task_evaluator.h"
#include "tests/unit/small_world.h"

namespace evalbus::metrics {
namespace {

using namespace small_world;

// The small world with a hinge: from -2 to 3 rad, second coordinate; and a wheel that turns for ever.
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
  // The success condition of a task of which only that differs.
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
  // 0.1 of the range is at -2 + 0.5.
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

  EXPECT_EQ(Error("{joint_fraction: {joint: pot/lid_hinge}}"), "'joint_fraction' needs 'min', 'max' or both");
  EXPECT_EQ(Error("{joint_fraction: {joint: pot/hinge, min: 0}}"),
            "no joint is called 'pot/hinge'; expected pot/lid_hinge, pot/wheel");
  EXPECT_EQ(Error("{joint_fraction: {joint: pot/wheel, min: 0}}"),
            "joint 'pot/wheel' has no range to be a fraction of");
}

TEST_F(PredicatesTest, PositionLimitsOneCoordinate) {
  state_.body_position_m[kPot] = {0.5, -0.2, 1};
  EXPECT_TRUE(Evaluate(Compile("{position: {object: pot, axis: y, max_m: -0.2}}").get()));
  EXPECT_FALSE(Evaluate(Compile("{position: {object: pot, axis: y, max_m: -0.21}}").get()));
  EXPECT_TRUE(Evaluate(Compile("{position: {object: pot, axis: x, min_m: 0.4, max_m: 0.6}}").get()));
  EXPECT_FALSE(Evaluate(Compile("{position: {object: pot, axis: z, min_m: 1.1}}").get()));
  EXPECT_EQ(Error("{position: {object: pot, axis: up, min_m: 0}}"),
            "key 'axis': expected x, y or z, got 'up'");
  EXPECT_EQ(Error("{position: {object: pot, axis: x}}"), "'position' needs 'min_m', 'max_m' or both");
}

TEST_F(PredicatesTest, InsideIsABoxOfTheWorld) {
  const auto box = Compile("{inside: {object: pot, center_m: [0.5, 0, 1], half_extents_m: [0.1, 0.2, 0.3]}}");
  state_.body_position_m[kPot] = {0.59, -0.19, 1.29};
  EXPECT_TRUE(Evaluate(box.get()));
  for (const std::vector<double>& outside :
       {std::vector<double>{0.61, 0, 1}, {0.39, 0, 1}, {0.5, 0.21, 1}, {0.5, -0.21, 1}, {0.5, 0, 1.31}}) {
    state_.body_position_m[kPot] = outside;
    EXPECT_FALSE(Evaluate(box.get())) << outside[0] << " " << outside[1] << " " << outside[2];
  }
  EXPECT_EQ(Error("{inside: {object: pot, center_m: [0.5, 0], half_extents_m: [1, 1, 1]}}"),
            "key 'center_m': expected a list of 3 numbers, got 2");
}

TEST_F(PredicatesTest, NumbersAreReadAsEverywhereInTheFile) {
  // Each stands in a line of its own, as the key of a block.
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
  // What is quoted is text.
  EXPECT_EQ(read("'1e3 '"), where + "'1e3 '");
  EXPECT_EQ(read("'1'"), where + "'1'");
  EXPECT_EQ(read("[1]"), where + "a list");
  for (const char* right : {"1e3 ", "1.1", "-9", "+9", ".5", "5.", "1E-3", "0"})
    EXPECT_EQ(read(right), "accepted") << right;
  // One of a list is named by its place.
  EXPECT_EQ(Error("{inside: {object: pot, center_m: [0.5, 0x10, 0], half_extents_m: [1, 1, 1]}}"),
            "key 'center_m[1]': expected a number, got '0x10'");
  EXPECT_EQ(Error("{tilt_below: {object: pot, max_deg: 0x10}}"),
            "key 'max_deg': expected a number, got '0x10'");
  EXPECT_EQ(Error("{tilt_below: {object: pot, max_deg: 1, max_rad: 1}}"),
            "key 'max_rad': give either this or 'max_deg'");
}

TEST_F(PredicatesTest, ALimitInDegreesIsTheNumberThatIsWritten) {
  // 60 degrees in radians and back are 59.99999999999999.
  const auto dut = Compile("{tilt_below: {object: pot, max_deg: 60}}");
  Evaluate(dut.get());
  std::vector<condition_t> why;
  dut->Explain(&why);
  EXPECT_EQ(why[0].threshold_mixed, 60);
}

TEST_F(PredicatesTest, FirstAndOtherGripperAreToldApartForAnEpisode) {
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
  // The next episode begins with the other hand.
  first->Start();
  other->Start();
  EXPECT_EQ(evaluate({{kLeftPad, kWall}}), Pair(true, false));
  // Both at one tick: the model's first gripper is the first.
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
            "'tilt_below': expected a limit of at most 90 degrees; upside down is never within it");
  model_info_t one_gripper = ModelWithJoints();
  one_gripper.gripper.pop_back();
  one_gripper.num_grippers = 1;
  EXPECT_EQ(Compile("{holding: {gripper: other, object: pot}}")->Describe(false),
            std::vector<std::string>{"the other gripper does not hold pot"});
  try {
    CompilePredicate(task_.success, {ModelNames(one_gripper), task_});
    FAIL() << "must throw";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("gripper 'other' needs a robot with two grippers"),
              std::string::npos)
        << error.what();
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
             "    the other gripper holds pot", "    fraction of the range of pot/lid_hinge at most 0.1"}));
  EXPECT_EQ(Compile("{not: {position: {object: pot, axis: x, min_m: 0, max_m: 1}}}")->Describe(true),
            (Lines{"x of pot not between 0 and 1 m"}));
  EXPECT_EQ(Compile("{latched: {touching: {a: pot, b: counter}}}")->Describe(true),
            (Lines{"at any time so far", "  pot touches counter"}));
}

}  // namespace
}  // namespace evalbus::metrics
