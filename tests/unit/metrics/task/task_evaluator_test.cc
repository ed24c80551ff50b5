// Tests predicates, quantities and verdicts in handwritten worlds.
#include "metrics/task/task_evaluator.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "base/errors.h"
#include "tests/unit/allocation_count.h"
#include "tests/unit/set_array.h"
#include "tests/unit/small_world.h"

namespace evalbus::metrics::task_evaluator_test {

using namespace small_world;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

constexpr double kDegree = std::numbers::pi / 180;

// Returns an expression as the YAML reader provides it, with the name in line 3 and the arguments in line 4.
Expression Call(const std::string& name, const std::vector<std::pair<std::string, std::string>>& arguments) {
  std::string text = "\n\n" + name + ":\n  {";
  for (const auto& [key, value] : arguments) text += key + ": " + value + ", ";
  return ReadExpression(ParseYaml(text + "}", "t.yaml"));
}

Expression Of(const std::string& name, std::vector<Expression> operands) {
  Expression expression = Call(name, {});
  expression.operands = std::move(operands);
  return expression;
}

std::array<double, 4> Rotation(double angle, double x, double y, double z) {
  return {std::cos(angle / 2), std::sin(angle / 2) * x, std::sin(angle / 2) * y, std::sin(angle / 2) * z};
}

class ExpressionTest : public testing::Test {
 protected:
  std::unique_ptr<Predicate> Compile(const Expression& expression) {
    return CompilePredicate(expression, {names_, task_});
  }
  bool Evaluate(const Expression& expression, const std::vector<std::pair<int, int>>& pairs = {}) {
    contacts_ = Contacts(1, pairs);
    return Compile(expression)->Evaluate({state_, contacts_.contact});
  }
  double Measure(const Expression& expression) {
    return CompileQuantity(expression, {names_, task_})->Evaluate({state_, contacts_.contact});
  }
  std::string PredicateError(const Expression& expression) {
    try {
      Compile(expression);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  std::string QuantityError(const Expression& expression) {
    try {
      CompileQuantity(expression, {names_, task_});
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  const model_info_t model_ = Model();
  const ModelNames names_{model_};
  const TaskDescription task_ = ParseTask(kTask, "small.yaml", false);
  state_t state_ = State(1);
  contacts_t contacts_{};
};

TEST_F(ExpressionTest, HoldingIsAPadTouchingTheObject) {
  const Expression left = Call("holding", {{"gripper", "left"}, {"object", "pot"}});
  const Expression any = Call("holding", {{"gripper", "any"}, {"object", "pot"}});
  EXPECT_TRUE(Evaluate(left, {{kLeftPad, kWall}}));
  EXPECT_TRUE(Evaluate(left, {{kFloor, kTop}, {kLeftPad, kLidGeom}}));
  EXPECT_TRUE(Evaluate(left, {{kLidGeom, kLeftPad}}));
  EXPECT_FALSE(Evaluate(left, {}));
  EXPECT_FALSE(Evaluate(left, {{kLeftLink, kWall}}));
  EXPECT_FALSE(Evaluate(left, {{kRightPad, kWall}}));
  EXPECT_FALSE(Evaluate(left, {{kTop, kLeftPad}, {kTop, kWall}}));
  contacts_ = Contacts(1, {{kLeftPad, kWall}});
  contacts_.contact[0].distance_m = 2e-8;
  EXPECT_FALSE(Compile(left)->Evaluate({state_, contacts_.contact})) << "near is not touching";
  EXPECT_TRUE(Evaluate(any, {{kRightPad, kWall}}));
  EXPECT_TRUE(Evaluate(any, {{kLeftPad, kWall}}));
  EXPECT_FALSE(Evaluate(any, {{kRightLink, kWall}}));
}

TEST_F(ExpressionTest, TouchingTakesEntitiesBodiesAndGeoms) {
  const auto touching = [](const char* a, const char* b) { return Call("touching", {{"a", a}, {"b", b}}); };
  EXPECT_TRUE(Evaluate(touching("pot", "counter"), {{kTop, kLidGeom}}));
  EXPECT_TRUE(Evaluate(touching("counter", "pot"), {{kTop, kLidGeom}}));
  EXPECT_FALSE(Evaluate(touching("pot/pot", "counter"), {{kTop, kLidGeom}}));
  EXPECT_TRUE(Evaluate(touching("pot/lid", "counter/top"), {{kTop, kLidGeom}}));
  EXPECT_TRUE(Evaluate(touching("pot", "world"), {{kFloor, kWall}}));
  EXPECT_TRUE(Evaluate(touching("pot", "floor"), {{kFloor, kWall}}));
  EXPECT_FALSE(Evaluate(touching("pot", "world"), {{kTop, kWall}, {-1, kWall}, {kWall, kNumGeoms}}));
}

TEST_F(ExpressionTest, HeightIsThatOfTheFirstBodysOrigin) {
  const Expression above = Call("height_above", {{"object", "pot"}, {"min_m", "1.1"}});
  EXPECT_FALSE(Evaluate(above));
  state_.body[kPot].position_m[2] = 1.1;
  EXPECT_TRUE(Evaluate(above));
  state_.body[kPot].position_m[2] = 1.0999;
  state_.body[kLid].position_m[2] = 2;
  EXPECT_FALSE(Evaluate(above));
  EXPECT_TRUE(Evaluate(Call("height_above", {{"object", "pot/lid"}, {"min_m", "1.1"}})));
  EXPECT_NEAR(Measure(Call("lift", {{"object", "pot"}})), 0.0999, 1e-12);
  EXPECT_NEAR(Measure(Call("lift", {{"object", "pot"}, {"rest_height_m", "0.97"}})), 0.1299, 1e-12);
}

TEST_F(ExpressionTest, TiltIsMeasuredAgainstTheVerticalOrPerpendicularToAnAxis) {
  const Expression free = Call("tilt", {{"object", "pot"}});
  const Expression lateral = Call("tilt", {{"object", "pot"}, {"axis", "y"}});
  const Expression forward = Call("tilt", {{"object", "pot"}, {"axis", "x"}});
  EXPECT_NEAR(Measure(free), 0, 1e-12);
  EXPECT_NEAR(Measure(lateral), 0, 1e-12);
  // A rotation about x tilts the up axis by 30 degrees toward -y or, if the angle is negative, toward y.
  for (double angle : {30., -30.}) {
    Set(&state_.body[kPot].quat_wxyz, Rotation(angle * kDegree, 1, 0, 0));
    EXPECT_NEAR(Measure(free), 30 * kDegree, 1e-12);
    EXPECT_NEAR(Measure(lateral), 30 * kDegree, 1e-12);
    EXPECT_NEAR(Measure(forward), 0, 1e-12);
  }
  // A rotation about y moves the up axis in the x-z plane, where it stays perpendicular to y.
  Set(&state_.body[kPot].quat_wxyz, Rotation(40 * kDegree, 0, 1, 0));
  EXPECT_NEAR(Measure(free), 40 * kDegree, 1e-12);
  EXPECT_NEAR(Measure(lateral), 0, 1e-12);
  EXPECT_NEAR(Measure(forward), 40 * kDegree, 1e-12);
  // Neither yaw nor the quaternion's norm matters.
  Set(&state_.body[kPot].quat_wxyz, Rotation(1, 0, 0, 1));
  for (double& x : state_.body[kPot].quat_wxyz) x *= -3;
  EXPECT_NEAR(Measure(free), 0, 1e-12);
  // The pot is upside down.
  Set(&state_.body[kPot].quat_wxyz, {0, 1, 0, 0});
  EXPECT_NEAR(Measure(free), std::numbers::pi, 1e-12);
  EXPECT_NEAR(Measure(lateral), 0, 1e-12);
}

TEST_F(ExpressionTest, TiltBelowAlsoRequiresTheObjectUpright) {
  const Expression lateral = Call("tilt_below", {{"object", "pot"}, {"axis", "y"}, {"max_deg", "20"}});
  const Expression free = Call("tilt_below", {{"object", "pot"}, {"max_rad", "0.5"}});
  EXPECT_TRUE(Evaluate(lateral));
  Set(&state_.body[kPot].quat_wxyz, Rotation(19.9 * kDegree, 1, 0, 0));
  EXPECT_TRUE(Evaluate(lateral));
  EXPECT_TRUE(Evaluate(free));
  Set(&state_.body[kPot].quat_wxyz, Rotation(-20.1 * kDegree, 1, 0, 0));
  EXPECT_FALSE(Evaluate(lateral));
  Set(&state_.body[kPot].quat_wxyz, Rotation(80 * kDegree, 0, 1, 0));
  EXPECT_TRUE(Evaluate(lateral)) << "the condition is about the lateral axis alone";
  EXPECT_FALSE(Evaluate(free));
  Set(&state_.body[kPot].quat_wxyz, Rotation(100 * kDegree, 0, 1, 0));
  EXPECT_FALSE(Evaluate(lateral)) << "upside down";
}

TEST_F(ExpressionTest, CombinesPredicates) {
  const Expression yes = Call("height_above", {{"object", "pot"}, {"min_m", "-9"}});
  const Expression no = Call("height_above", {{"object", "pot"}, {"min_m", "9"}});
  EXPECT_TRUE(Evaluate(Of("all", {yes, yes})));
  EXPECT_FALSE(Evaluate(Of("all", {yes, no})));
  EXPECT_TRUE(Evaluate(Of("any", {no, yes})));
  EXPECT_FALSE(Evaluate(Of("any", {no, no})));
  EXPECT_FALSE(Evaluate(Of("not", {yes})));
  EXPECT_TRUE(Evaluate(Of("not", {no})));
}

TEST_F(ExpressionTest, LatchedUsesEveryTickAndResetsAtStart) {
  const Expression no = Call("height_above", {{"object", "pot"}, {"min_m", "9"}});
  const Expression held = Call("holding", {{"gripper", "left"}, {"object", "pot"}});
  // An earlier operand that already decides `all` or `any` must not prevent `latched` from processing the
  // tick.
  const auto dut = Compile(Of("any", {Of("all", {no, Of("latched", {held})}), Of("latched", {held})}));
  const auto evaluate = [&](const std::vector<std::pair<int, int>>& pairs) {
    contacts_ = Contacts(1, pairs);
    return dut->Evaluate({state_, contacts_.contact});
  };
  EXPECT_FALSE(evaluate({}));
  EXPECT_TRUE(evaluate({{kLeftPad, kWall}}));
  EXPECT_TRUE(evaluate({}));
  dut->Start();
  EXPECT_FALSE(evaluate({}));

  const auto all = Compile(
      Of("all", {Call("height_above", {{"object", "pot"}, {"min_m", "1.1"}}), Of("latched", {held})}));
  contacts_ = Contacts(1, {{kLeftPad, kWall}});
  EXPECT_FALSE(all->Evaluate({state_, contacts_.contact}));
  state_.body[kPot].position_m[2] = 2;
  contacts_ = Contacts(2, {});
  EXPECT_TRUE(all->Evaluate({state_, contacts_.contact}));
}

TEST_F(ExpressionTest, DistanceIsFromAGrippersWristOrABodysOrigin) {
  state_.arm[1].wrist_position_m[0] = 1;
  state_.arm[1].wrist_position_m[1] = 2;
  state_.arm[1].wrist_position_m[2] = 3;
  Set(&state_.body[kPot].position_m, {1, 5, 7});
  Set(&state_.body[kLid].position_m, {1, 5, 8});
  const auto distance = [](const char* a, const char* b) { return Call("distance", {{"a", a}, {"b", b}}); };
  EXPECT_DOUBLE_EQ(Measure(distance("right", "pot")), 5);
  EXPECT_DOUBLE_EQ(Measure(distance("pot", "right")), 5);
  EXPECT_DOUBLE_EQ(Measure(distance("pot", "pot/lid")), 1);
  EXPECT_DOUBLE_EQ(Measure(distance("pot", "right/base")), std::sqrt(1 + 25 + 49));
}

TEST_F(ExpressionTest, ReportsMistakesWithFileAndLine) {
  // Other tests of this program register names of their own.
  const std::string predicate = PredicateError(Call("holds", {}));
  EXPECT_THAT(predicate, StartsWith("t.yaml:3: there is no predicate 'holds'; expected one of "));
  EXPECT_THAT(predicate,
              HasSubstr("all, any, distance, height_above, holding, inside, joint_fraction, joint_speed, "
                        "lasts, latched, lift, "));
  EXPECT_THAT(predicate, EndsWith("on, position, reached, speed, tilt, tilt_below, touching"));
  const std::string quantity = QuantityError(Call("height", {}));
  EXPECT_THAT(quantity, StartsWith("t.yaml:3: there is no quantity 'height'; expected one of distance, "
                                   "joint_fraction, joint_speed, lift, "));
  EXPECT_THAT(quantity, EndsWith("position, speed, tilt"));
  EXPECT_EQ(QuantityError(Call("dist", {})),
            "t.yaml:3: there is no quantity 'dist'; did you mean 'distance'?");
  EXPECT_EQ(PredicateError(Call("holding", {{"gripper", "left"}})),
            "t.yaml:3: key 'object': required here, but missing in 'holding'");
  EXPECT_EQ(PredicateError(Call("holding", {{"gripper", "left"}, {"object", "pot"}, {"arm", "left"}})),
            "t.yaml:4: key 'arm': unknown key here; expected one of gripper, object");
  EXPECT_EQ(PredicateError(Call("holding", {{"griper", "left"}, {"object", "pot"}})),
            "t.yaml:4: key 'griper': unknown key here; did you mean 'gripper'?");
  EXPECT_EQ(PredicateError(Call("holding", {{"gripper", "third"}, {"object", "pot"}})),
            "t.yaml:4: no gripper has the name 'third'; expected left, right or any");
  EXPECT_EQ(
      PredicateError(Call("touching", {{"a", "kettle"}, {"b", "counter"}})),
      "t.yaml:4: nothing has the name 'kettle'; expected an entity (counter, left, pot, right, world), a "
      "gripper (left_gripper, right_gripper), a body (counter/counter, left/base, left/hand, pot/lid, "
      "pot/pot, right/base, right/hand, world) or a geom (counter/top, floor, left/link, left/pad, "
      "pot/wall, right/link, right/pad)");
  EXPECT_EQ(PredicateError(Call("touching", {{"a", "pott"}, {"b", "counter"}})),
            "t.yaml:4: nothing has the name 'pott'; did you mean 'pot'?");
  EXPECT_EQ(QuantityError(Call("lift", {{"object", "countr"}})),
            "t.yaml:4: no entity or body has the name 'countr'; did you mean 'counter'?");
  EXPECT_EQ(PredicateError(Call("height_above", {{"object", "pot"}, {"min_m", "high"}})),
            "t.yaml:4: key 'min_m': expected a number, got 'high'");
  EXPECT_EQ(PredicateError(Call("height_above", {{"object", "pot"}, {"min_m", "nan"}})),
            "t.yaml:4: key 'min_m': expected a number, got 'nan'");
  EXPECT_EQ(PredicateError(Call("tilt_below", {{"object", "pot"}})),
            "t.yaml:3: 'tilt_below' requires either 'max_deg' or 'max_rad'");
  EXPECT_EQ(PredicateError(Call("tilt_below", {{"object", "pot"}, {"max_deg", "1"}, {"axis", "z"}})),
            "t.yaml:4: key 'axis': expected x or y, got 'z'");
  EXPECT_EQ(PredicateError(Of("all", {})),
            "t.yaml:3: 'all' requires predicates, as in all: [{touching: {a: pot, b: world}}]");
  EXPECT_EQ(PredicateError(Of("touching", {Call("not", {})})),
            "t.yaml:3: 'touching' takes arguments, not other expressions");
  const Expression yes = Call("height_above", {{"object", "pot"}, {"min_m", "-9"}});
  EXPECT_EQ(PredicateError(Of("not", {yes, yes})), "t.yaml:3: 'not' requires exactly one predicate");
  EXPECT_EQ(
      QuantityError(Call("distance", {{"a", "floor"}, {"b", "pot"}})),
      "t.yaml:4: no entity or body has the name 'floor'; expected an entity (counter, left, pot, right, "
      "world) or a body (counter/counter, left/base, left/hand, pot/lid, pot/pot, right/base, right/hand, "
      "world)");
  EXPECT_EQ(QuantityError(Call("lift", {{"object", "left"}})),
            "t.yaml:4: 'lift' requires a part of the scene; 'left' is not one");
}

TEST(ModelNames, WhatMustNotBeTouchedOfAnObjectIsNone) {
  model_info_t model = Model();
  model.forbidden_contact_geom = {kLidGeom};
  model.num_forbidden_contact_geoms = 1;
  const ModelNames names(model);
  EXPECT_TRUE(names.IsObject(kWall));
  EXPECT_FALSE(names.IsObject(kLidGeom));
  EXPECT_FALSE(names.IsObject(kTop));
}

TEST(ModelNames, RefusesAModelThatContradictsItself) {
  const auto expect_refused = [](auto change) {
    model_info_t model = Model();
    change(&model);
    EXPECT_THROW(ModelNames{model}, InputError);
  };
  expect_refused([](model_info_t* m) { m->message_version = 99; });
  expect_refused([](model_info_t* m) { m->substeps = 0; });
  expect_refused([](model_info_t* m) { m->geom_body[2] = 99; });
  expect_refused([](model_info_t* m) { m->body_entity[2] = -1; });
  expect_refused([](model_info_t* m) { m->gripper[1].pad_geom[0] = kNumGeoms; });
  expect_refused([](model_info_t* m) { m->gripper[1].arm = 2; });
  expect_refused([](model_info_t* m) { m->object_entity[0] = 5; });
  expect_refused([](model_info_t* m) { m->forbidden_contact_geom = {kNumGeoms}; });
}

class TaskEvaluatorTest : public testing::Test {
 protected:
  void Evaluate(int64_t tick, const std::vector<std::pair<int, int>>& pairs) {
    contacts_ = Contacts(tick, pairs);
    dut_.Evaluate({state_, contacts_.contact}, tick);
  }
  const model_info_t model_ = Model();
  const ModelNames names_{model_};
  TaskEvaluator dut_{ParseTask(kTask, "small.yaml", false), names_};
  state_t state_ = State(0);
  contacts_t contacts_{};
};

TEST_F(TaskEvaluatorTest, KeepsStagesAndTheFirstVerdict) {
  dut_.Start();
  Evaluate(0, {{kLeftPad, kWall}, {kTop, kWall}});
  EXPECT_EQ(dut_.stage_reached(), (std::vector<uint8_t>{0, 0})) << "the reset state is not judged";
  Evaluate(1, {{kLeftPad, kWall}, {kTop, kWall}});
  EXPECT_EQ(dut_.stage_reached(), (std::vector<uint8_t>{1, 0}));
  EXPECT_EQ(dut_.verdict(), Verdict::kUndecided);
  state_.body[kPot].position_m[2] = 1.2;
  Evaluate(2, {});
  EXPECT_EQ(dut_.stage_reached(), (std::vector<uint8_t>{1, 1}));
  EXPECT_EQ(dut_.verdict(), Verdict::kSuccess);
  EXPECT_NEAR(dut_.target_distance()[0], 0.2, 1e-12);
  EXPECT_NEAR(dut_.target_distance()[1], 0.3, 1e-12);
  state_.body[kPot].position_m[2] = 0;
  Evaluate(3, {{kFloor, kWall}});
  EXPECT_EQ(dut_.verdict(), Verdict::kSuccess);
  dut_.Start();
  EXPECT_EQ(dut_.verdict(), Verdict::kUndecided);
  EXPECT_EQ(dut_.stage_reached(), (std::vector<uint8_t>{0, 0}));
}

// The task has two conditions for success: the pot does not touch the counter, and its height is at least 1.1
// m. The task fails if the pot touches the world.
TEST_F(TaskEvaluatorTest, CriteriaAreAllConditionsMetOrNot) {
  dut_.Start();
  Evaluate(0, {{kTop, kWall}});
  criteria_t criteria{};
  dut_.Criteria(&criteria);
  ASSERT_EQ(criteria.num_success, 2);
  ASSERT_EQ(criteria.num_failure, 1);
  // The reset state is not evaluated.
  for (const condition_t& condition : criteria.success) EXPECT_FALSE(condition.holds) << condition.text;
  EXPECT_TRUE(std::isnan(criteria.success[1].value_mixed));
  EXPECT_EQ(criteria.success[1].threshold_mixed, 1.1);

  state_.header = Header(1);
  state_.body[kPot].position_m[2] = 1.2;
  Evaluate(1, {{kTop, kWall}});
  const int64_t before = AllocationCount();
  dut_.Criteria(&criteria);
  EXPECT_EQ(AllocationCount(), before);
  ASSERT_EQ(criteria.success.size(), 2u);
  EXPECT_EQ(criteria.success[0].predicate, "touching");
  EXPECT_EQ(criteria.success[0].text, "pot does not touch counter");
  EXPECT_FALSE(criteria.success[0].holds);
  EXPECT_FALSE(criteria.success[0].has_value);
  EXPECT_EQ(criteria.success[1].text, "height of pot at least 1.1 m");
  EXPECT_TRUE(criteria.success[1].holds);
  EXPECT_EQ(criteria.success[1].value_mixed, 1.2);
  EXPECT_EQ(criteria.success[1].comparison, ">=");
  EXPECT_EQ(criteria.success[1].tick, 1);
  EXPECT_EQ(criteria.failure[0].text, "pot touches world");
  EXPECT_FALSE(criteria.failure[0].holds);

  Evaluate(2, {});
  dut_.Criteria(&criteria);
  EXPECT_TRUE(criteria.success[0].holds);
  Evaluate(3, {{kFloor, kWall}});
  dut_.Criteria(&criteria);
  EXPECT_TRUE(criteria.failure[0].holds);
}

TEST_F(TaskEvaluatorTest, CriteriaOfWhatLastsIsLatchedOrNotWithin) {
  std::string text = kTask;
  const size_t begin = text.find("success:"), end = text.find("failure:");
  text.replace(begin, end - begin,
               "success:\n  all:\n"
               "    - not: {height_above: {object: pot, min_m: 1.1}}\n"
               "    - latched: {touching: {a: pot, b: counter}}\n"
               "    - lasts: {min_s: 0.04, when: {touching: {a: pot, b: world}}}\n");
  TaskEvaluator dut(ParseTask(text, "small.yaml", false), names_);
  dut.Start();
  criteria_t criteria{};
  const auto evaluate = [&](int64_t tick, const std::vector<std::pair<int, int>>& pairs) {
    state_.header = Header(tick);
    contacts_ = Contacts(tick, pairs);
    dut.Evaluate({state_, contacts_.contact}, tick);
    dut.Criteria(&criteria);
  };
  evaluate(1, {{kTop, kWall}});
  ASSERT_EQ(criteria.num_success, 5);
  const std::vector<condition_t>& c = criteria.success;
  EXPECT_EQ(c[0].text, "height of pot not at least 1.1 m");
  EXPECT_TRUE(c[0].holds);
  EXPECT_EQ(c[0].comparison, "<=");
  EXPECT_TRUE(c[1].holds);
  EXPECT_EQ(c[2].text, "at any time so far");
  EXPECT_TRUE(c[2].holds);
  EXPECT_EQ(c[4].text, "for 0.04 s or longer");
  EXPECT_FALSE(c[4].holds);
  EXPECT_EQ(c[4].value_mixed, 0);
  // The pot is off the counter and on the floor for 0, 20 and 40 ms.
  evaluate(2, {{kFloor, kWall}});
  EXPECT_FALSE(c[1].holds);
  EXPECT_TRUE(c[2].holds);
  EXPECT_TRUE(c[3].holds);
  EXPECT_FALSE(c[4].holds);
  evaluate(3, {{kFloor, kWall}});
  EXPECT_EQ(c[4].value_mixed, 0.02);
  evaluate(4, {{kFloor, kWall}});
  EXPECT_EQ(c[4].value_mixed, 0.04);
  EXPECT_TRUE(c[4].holds);
}

TEST_F(TaskEvaluatorTest, StartUnlatchesEverything) {
  const auto held = [] { return Of("latched", {Call("holding", {{"gripper", "left"}, {"object", "pot"}})}); };
  TaskDescription task;
  task.stages = {{1, "held", held()}};
  task.success = Of("all", {held(), Call("height_above", {{"object", "pot"}, {"min_m", "1.1"}})});
  TaskEvaluator dut(task, names_);
  dut.Start();
  contacts_ = Contacts(1, {{kLeftPad, kWall}});
  dut.Evaluate({state_, contacts_.contact}, 1);
  EXPECT_EQ(dut.stage_reached(), std::vector<uint8_t>{1});
  dut.Start();
  state_.body[kPot].position_m[2] = 2;
  contacts_ = Contacts(1, {});
  dut.Evaluate({state_, contacts_.contact}, 1);
  EXPECT_EQ(dut.stage_reached(), std::vector<uint8_t>{0});
  EXPECT_EQ(dut.verdict(), Verdict::kUndecided);
}

// One condition of an `any` is enough, so the others are not missing.
TEST_F(TaskEvaluatorTest, AMetGroupLacksNoCondition) {
  const auto touches = [](const char* b) { return Call("touching", {{"a", "pot"}, {"b", b}}); };
  TaskDescription task;
  task.success =
      Of("all", {Of("any", {touches("counter"), touches("world")}),
                 Of("not", {Of("all", {touches("counter"), touches("world")})}), touches("world")});
  TaskEvaluator dut(task, names_);
  const auto met = [&](int64_t tick, const std::vector<std::pair<int, int>>& pairs) {
    contacts_ = Contacts(tick, pairs);
    state_.header = small_world::Header(tick);
    dut.Evaluate({state_, contacts_.contact}, tick);
    std::vector<std::vector<condition_t>> conditions;
    dut.ConditionsByStage(&conditions);
    std::vector<bool> holds;
    for (const condition_t& condition : conditions.back()) holds.push_back(condition.holds);
    return holds;
  };
  dut.Start();
  EXPECT_EQ(met(1, {{kTop, kWall}}), (std::vector<bool>{true, true, true, true, false}));
  EXPECT_EQ(met(2, {}), (std::vector<bool>{false, false, true, true, false}));
}

// Below `latched` and `lasts`, the current state of a condition may not matter.
TEST_F(TaskEvaluatorTest, WhatWasLatchedOrMustNotHappenIsNotMissing) {
  const auto touches = [](const char* b) {
    return Of("latched", {Call("touching", {{"a", "pot"}, {"b", b}})});
  };
  TaskDescription task;
  task.time_limit = 10;
  const YamlValue lasts =
      ParseYaml("lasts: {min_s: 7, when: {height_above: {object: pot, min_m: 1.1}}}", "t.yaml");
  task.success = Of("all", {touches("counter"), Of("not", {touches("world")}), ReadExpression(lasts)});
  TaskEvaluator dut(task, names_);
  std::vector<std::vector<condition_t>> conditions;
  const auto met = [&](int64_t tick, const std::vector<std::pair<int, int>>& pairs) {
    contacts_ = Contacts(tick, pairs);
    state_.header = small_world::Header(tick);
    dut.Evaluate({state_, contacts_.contact}, tick);
    dut.ConditionsByStage(&conditions);
    std::vector<bool> holds;
    for (const condition_t& condition : conditions.back()) holds.push_back(condition.holds);
    return holds;
  };
  dut.Start();
  EXPECT_EQ(met(1, {}), (std::vector<bool>{false, false, true, true, false, false}));
  std::vector<std::string> texts;
  for (const condition_t& condition : conditions.back()) texts.push_back(condition.text);
  EXPECT_EQ(texts, (std::vector<std::string>{
                       "pot touches counter", "at any time so far: pot touches counter",
                       "pot does not touch world", "at no time so far: pot touches world",
                       "height of pot at least 1.1 m", "for 7 s or longer: height of pot at least 1.1 m"}));
  EXPECT_EQ(met(2, {{kTop, kWall}}), (std::vector<bool>{true, true, true, true, false, false}));
  EXPECT_EQ(met(3, {}), (std::vector<bool>{true, true, true, true, false, false}));
  EXPECT_EQ(met(4, {{kFloor, kWall}}), (std::vector<bool>{true, true, true, false, false, false}));
}

TEST_F(TaskEvaluatorTest, AStageOfAnUnknownObjectHasNoConditions) {
  TaskDescription task;
  task.stages = {{1, "held", Call("holding", {{"gripper", "left"}, {"object", "pot"}})},
                 {2, "fast", Call("joint_speed", {{"arm", "left"}, {"min_radps", "1"}})}};
  task.success = Call("joint_speed", {{"arm", "left"}, {"min_radps", "2"}});
  model_info_t model = model_;
  model.object_is_tracked = {0};
  const ModelNames names(model);
  TaskEvaluator dut(task, names);
  dut.Start();
  contacts_ = Contacts(1, {});
  dut.Evaluate({state_, contacts_.contact}, 1);
  std::vector<std::vector<condition_t>> conditions;
  dut.ConditionsByStage(&conditions);
  ASSERT_EQ(conditions.size(), 3u);
  EXPECT_TRUE(conditions[0].empty());
  EXPECT_EQ(conditions[1].size(), 1u);
  EXPECT_EQ(conditions[2].size(), 1u);
}

TEST_F(TaskEvaluatorTest, StagesCanAskForAnOrder) {
  const auto at_height = [](const char* min) {
    return Call("height_above", {{"object", "pot"}, {"min_m", min}});
  };
  TaskDescription task;
  task.stages = {{1, "low", Of("all", {Call("touching", {{"a", "pot"}, {"b", "counter"}})})},
                 {2, "high", Of("all", {Call("reached", {{"stage", "low"}}), at_height("1.1")})}};
  task.success = Call("reached", {{"stage", "high"}});
  TaskEvaluator dut(task, names_);
  const auto evaluate = [&](int64_t tick, double height, const std::vector<std::pair<int, int>>& pairs) {
    contacts_ = Contacts(tick, pairs);
    state_.header = small_world::Header(tick);
    state_.body[kPot].position_m[2] = height;
    dut.Evaluate({state_, contacts_.contact}, tick);
    return dut.stage_reached();
  };
  dut.Start();
  EXPECT_EQ(evaluate(1, 2, {}), (std::vector<uint8_t>{0, 0})) << "high, but not low before";
  EXPECT_EQ(dut.ExplainVerdict()[0].text, "stage high was not reached");
  EXPECT_EQ(evaluate(2, 1, {{kTop, kWall}}), (std::vector<uint8_t>{1, 0}));
  EXPECT_EQ(evaluate(3, 2, {}), (std::vector<uint8_t>{1, 1}));
  EXPECT_EQ(dut.verdict(), Verdict::kSuccess);
  dut.Start();
  EXPECT_EQ(evaluate(1, 2, {}), (std::vector<uint8_t>{0, 0})) << "the episode before is forgotten";

  // A stage can only depend on a stage that is evaluated earlier.
  task.stages[0].when = Call("reached", {{"stage", "high"}});
  try {
    TaskEvaluator refused(task, names_);
    FAIL() << "must throw";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), "t.yaml:4: key 'stage': no stage before this one is called 'high'");
  }
}

TEST_F(TaskEvaluatorTest, FailureGoesBeforeSuccess) {
  dut_.Start();
  state_.body[kPot].position_m[2] = 1.2;
  Evaluate(1, {{kFloor, kWall}});
  EXPECT_EQ(dut_.verdict(), Verdict::kFailure);
  EXPECT_FALSE(dut_.out_of_bounds());
}

TEST_F(TaskEvaluatorTest, ARobotFarAwayIsAFailureOfAnyTask) {
  dut_.Start();
  Set(&state_.body[kPot].position_m, {20, 0, 0});
  Set(&state_.body[kRightHand].position_m, {6, 8, 0});
  Evaluate(1, {{kTop, kWall}});
  EXPECT_EQ(dut_.verdict(), Verdict::kUndecided);
  Set(&state_.body[kRightHand].position_m, {6, 8, 0.1});
  Evaluate(2, {{kTop, kWall}});
  EXPECT_EQ(dut_.verdict(), Verdict::kFailure);
  EXPECT_TRUE(dut_.out_of_bounds());
}

}  // namespace evalbus::metrics::task_evaluator_test
