// Seeds and variations for which RoboEval has no start are refused. The starts themselves are tested by
// AllTasksTest.SeedsOfRoboEvalPlaceObjectsAsItDoes.
#include "sim/roboeval_start.h"

#include <gtest/gtest.h>

#include "sim/sim_options.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::sim::roboeval_start_test {

Variation LiftPot() {
  return FindTask("lift_pot/position_and_orientation").task.variation("position_and_orientation");
}

std::string Refusal(const Variation& variation) {
  const std::string error = ErrorOf([&] { CheckRoboEvalStart(variation); });
  return error.substr(error.find("cannot start"));
}

TEST(RoboEvalStart, VariationsThatRandomizeNothingHaveOne) {
  Variation variation;
  EXPECT_NO_THROW(CheckRoboEvalStart(variation));
  EXPECT_TRUE(DrawRoboEvalStart(variation, 7).empty());
}

TEST(RoboEvalStart, OthersAreRefused) {
  EXPECT_NO_THROW(CheckRoboEvalStart(LiftPot()));
  Variation variation = LiftPot();
  variation.alias.clear();
  EXPECT_EQ(Refusal(variation), "cannot start as in RoboEval: it has no alias, the name of RoboEval's class");
  variation.alias = "LiftPan";
  EXPECT_EQ(Refusal(variation),
            "cannot start as in RoboEval: how RoboEval's class 'LiftPan' draws a start is unknown");
  variation.alias = "LiftPotPosition";
  EXPECT_EQ(
      Refusal(variation),
      "cannot start as in RoboEval: LiftPotPosition does not draw everything that the variation randomizes");
  variation = LiftPot();
  variation.randomizations.pop_back();
  EXPECT_EQ(Refusal(variation),
            "cannot start as in RoboEval: LiftPotPositionAndOrientation also draws a pose of 'pot'");
  variation = LiftPot();
  variation.distractors.emplace_back();
  EXPECT_EQ(Refusal(variation), "cannot start as in RoboEval: it has distractors");
}

TEST(RoboEvalStart, SeedsAreThoseThatNumPyAccepts) {
  EXPECT_NO_THROW(CheckSeeds(kRoboEvalSeeds, 0, 1));
  EXPECT_NO_THROW(CheckSeeds(kRoboEvalSeeds, 4294967295, 1));
  EXPECT_NO_THROW(CheckSeeds(kRunSeeds, -1, 1));
  EXPECT_EQ(
      ErrorOf([] { CheckSeeds(kRoboEvalSeeds, 4294967295, 2); }),
      "--seed-stream roboeval/1: expected seeds from 0 to 4294967295, got --seed 4294967295 and 2 episodes");
  EXPECT_NE(ErrorOf([] { CheckSeeds(kRoboEvalSeeds, -1, 1); }), "");
}

}  // namespace evalbus::sim::roboeval_start_test
