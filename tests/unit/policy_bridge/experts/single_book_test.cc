// Tests the expert for the tasks with one book in the simulated world.
#include "tests/unit/policy_bridge/expert_play.h"

namespace evalbus::policy::single_book_test {

TEST(SingleBookExpert, PicksUpOnEachVariation) {
  for (const std::string variation : {"base", "position", "orientation", "position_and_orientation"}) {
    ExpertStage stage("pick_single_book_from_table/" + variation);
    for (const int64_t seed : {6, 9}) stage.ExpectSuccess(seed);
  }
}

TEST(SingleBookExpert, PutsOnTheShelfOnEachVariation) {
  for (const std::string variation : {"base", "position", "position_and_orientation"}) {
    ExpertStage stage("stack_single_book_shelf/" + variation);
    for (const int64_t seed : {6, 9}) stage.ExpectSuccess(seed);
  }
}

TEST(SingleBookExpert, PicksUpWithOneArm) {
  ExpertStage stage("pick_single_book_from_table/position_and_orientation", "single_panda");
  for (const int64_t seed : {3, 4}) stage.ExpectSuccess(seed);
}

TEST(SingleBookExpert, WorksAtAnyControlRate) {
  ExpertStage stage("stack_single_book_shelf/position_and_orientation");
  stage.ExpectSuccess(5, 20);
  stage.ExpectSuccess(5, 500);
}

TEST(SingleBookExpert, EqualSeedsGiveEqualActionsWhateverCameBefore) {
  const std::string task = "pick_single_book_from_table/position";
  ExpertStage stage(task);
  const auto first = stage.Play(6).actions;
  EXPECT_NE(first, stage.Play(7).actions);
  EXPECT_EQ(first, stage.Play(6).actions);
  EXPECT_EQ(first, ExpertStage(task).Play(6).actions);
}

}  // namespace evalbus::policy::single_book_test
