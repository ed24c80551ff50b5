// Tests the experts for StackTwoBlocks and CubeHandover in the simulated world.
#include "base/errors.h"
#include "tests/unit/policy_bridge/expert_play.h"

namespace evalbus::policy::block_experts_test {

// The stage "other_cube_held" requires that hands hold both cubes at the same time.
constexpr size_t kBothHeld = 2;

TEST(StackTwoBlocksExpert, SucceedsOnEachVariation) {
  for (const std::string variation : {"base", "position", "orientation", "position_and_orientation"}) {
    ExpertStage stage("stack_two_blocks/" + variation);
    for (const int64_t seed : {3, 4}) stage.ExpectSuccess(seed, 50, kBothHeld);
  }
}

TEST(StackTwoBlocksExpert, StacksWithOneArm) {
  for (const std::string variation : {"base", "position_and_orientation"}) {
    ExpertStage stage("stack_two_blocks/" + variation, "single_panda");
    for (const int64_t seed : {3, 4}) stage.ExpectSuccess(seed, 50, kBothHeld);
  }
}

TEST(CubeHandoverExpert, SucceedsOnEachVariation) {
  for (const std::string variation :
       {"base", "position", "orientation", "position_and_orientation", "vertical"}) {
    ExpertStage stage("cube_handover/" + variation);
    for (const int64_t seed : {3, 4}) stage.ExpectSuccess(seed);
  }
}

TEST(CubeHandoverExpert, WorksAtAnyControlRate) {
  ExpertStage stage("cube_handover/vertical");
  stage.ExpectSuccess(5, 20);
  stage.ExpectSuccess(5, 500);
}

TEST(BlockExperts, EqualSeedsGiveEqualActionsWhateverCameBefore) {
  for (const std::string task : {"stack_two_blocks/position", "cube_handover/position"}) {
    ExpertStage stage(task);
    const auto first = stage.Play(6).actions;
    const auto other = stage.Play(7).actions;
    EXPECT_NE(first, other);
    EXPECT_EQ(first, stage.Play(6).actions);
    EXPECT_EQ(first, ExpertStage(task).Play(6).actions);
  }
}

TEST(CubeHandoverExpert, OneArmIsTooFew) {
  const TaskSelection handover = FindTask("cube_handover");
  const Scene scene = BuildScene(handover.task, LoadRobot(FindRobot("single_panda")));
  try {
    MakePolicy("expert", *scene.physics, scene.info);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "policy \"expert\": cube_handover requires a robot with two arms");
  }
}

TEST(CubeHandoverExpert, NamesWhatItMissesInAnotherScene) {
  const TaskSelection pot = FindTask("lift_pot");
  const Scene scene = BuildScene(pot.task, LoadRobot(pot.task.robot_file));
  try {
    MakePolicy("expert:cube_handover", *scene.physics, scene.info);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "policy \"expert\": the task has no object \"rod\"");
  }
}

// Props that were dropped as the task specifies lie still and neither creep nor vibrate.
TEST(BlockProps, LieStill) {
  for (const std::string name : {"stack_two_blocks/base", "cube_handover/base", "cube_handover/vertical"}) {
    SCOPED_TRACE(name);
    const TaskSelection selection = FindTask(name);
    const RobotDescription robot = LoadRobot(selection.task.robot_file);
    const Scene scene = BuildScene(selection.task, robot);
    sim::World world(scene.physics.get(), scene.info, robot, selection.task, 10);
    world.Reset(1, selection.task.variation(selection.variation));
    state_t dropped{}, settled{}, state{};
    world.Fill(&dropped);
    const auto simulate = [&](int seconds) {
      for (int tick = 0; tick < 50 * seconds; ++tick) ASSERT_TRUE(world.Step());
    };
    simulate(1);
    world.Fill(&settled);
    for (int i = 0; i < 10; ++i) {
      simulate(1);
      world.Fill(&state);
      for (const std::string& object : selection.task.objects) {
        const int body = mj_name2id(scene.physics.get(), mjOBJ_BODY, object.c_str());
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_NEAR(state.body[body].position_m[axis], settled.body[body].position_m[axis], 1e-3) << object;
        }
        // The object lies on its lower face at the place where it was dropped.
        for (int axis = 0; axis < 2; ++axis) {
          EXPECT_NEAR(state.body[body].position_m[axis], dropped.body[body].position_m[axis], 1e-3) << object;
        }
        const double height = name.ends_with("vertical") ? 0.1 : 0.02;
        EXPECT_NEAR(state.body[body].position_m[2], 0.95 + height, 1e-3);
      }
    }
  }
}

}  // namespace evalbus::policy::block_experts_test
