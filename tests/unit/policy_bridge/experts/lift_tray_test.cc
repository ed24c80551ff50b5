// Tests the expert for LiftTray in the simulated world.
#include "tests/unit/policy_bridge/expert_play.h"

namespace evalbus::policy::lift_tray_test {

TEST(LiftTrayExpert, SucceedsOnEachVariation) {
  for (const std::string variation : {"base", "position", "orientation", "position_and_orientation"}) {
    ExpertStage stage("lift_tray/" + variation);
    for (const int64_t seed : {3, 4}) stage.ExpectSuccess(seed);
  }
}

TEST(LiftTrayExpert, DragsTheTrayOverBeforeItLifts) {
  ExpertStage stage("lift_tray/drag_over");
  stage.ExpectSuccess(3);
  EXPECT_GT(stage.Play(3).time, 8);
}

TEST(LiftTrayExpert, WorksAtAnyControlRate) {
  ExpertStage stage("lift_tray/position_and_orientation");
  stage.ExpectSuccess(5, 20);
  stage.ExpectSuccess(5, 500);
}

}  // namespace evalbus::policy::lift_tray_test
