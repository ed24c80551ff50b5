// Variations that change the scene and the verdict, and parts that are placed at each reset.
#include <cmath>

#include "models/scene.h"
#include "sim/world.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::sim {
namespace {

// A box with a hinged lid, fixed to a table but placed anew by one variation.
constexpr const char* kBox = R"(<mujoco><compiler angle="radian"/><worldbody>
  <geom name="wall" type="box" size="0.1 0.1 0.1" pos="0 0 0.1"/>
  <body name="lid" pos="0 0 0.25">
    <joint name="lid" type="hinge" axis="0 1 0" range="-1 2" limited="true" ref="2" damping="10"/>
    <geom name="lid" type="box" size="0.1 0.1 0.01" mass="0.1"/>
  </body>
</worldbody></mujoco>)";

std::string TaskText(const std::string& box) {
  const std::string models = ModelsFolder().string();
  return R"(name: fill
title: Fill the box
robot: {file: )" +
         models + R"(/robots/bimanual_panda.yaml}
time_limit_s: 10
scene:
  base: )" +
         models + R"(/props/scene_base.xml
  parts:
    - {name: box, model: )" +
         box + R"(, pose: {position_m: [0.8, 0, 0], yaw_deg: 90}}
objects: [box]
variations:
  base: {}
  placed:
    randomise:
      - spawn_plane: {objects: [box], origin_m: [0.8, 0, 0.1], half_extents_m: [0.1, 0.1], spacing_m: 0.1}
      - spawn_yaw: {object: box, bound_deg: 30}
  elsewhere:
    robot_base: {position_m: [0.1, 0, 0], yaw_deg: 5}
    poses:
      box: {position_m: [1, 0.1, 0.2]}
    stages:
      - name: first
        when: {holding: {gripper: left, object: box}}
      - name: second
        when: {holding: {gripper: right, object: box}}
    success: {holding: {gripper: any, object: box}}
    failure: {touching: {a: box, b: world}}
stages:
  - name: touched
    when: {touching: {a: left, b: box}}
success: {touching: {a: right, b: box}}
)";
}

class VariationTest : public testing::Test {
 protected:
  TaskDescription Task() { return ParseTask(TaskText(box_.string()), "t.yaml", true); }
  std::string Error(const std::string& from, const std::string& to) {
    return ErrorOf([&] { ParseTask(ReplaceFirst(TaskText(box_.string()), from, to), "t.yaml", true); });
  }

  TempFolder folder_;
  const std::filesystem::path box_ = folder_.Write("box.xml", kBox);
};

TEST_F(VariationTest, ReplacesWhatItStates) {
  TaskDescription task = Task();
  task.Apply("base");
  EXPECT_EQ(task.robot_base.position[0], 0);
  EXPECT_EQ(task.parts[0].pose.position[0], 0.8);
  EXPECT_EQ(task.stages.size(), 1u);
  EXPECT_EQ(task.success.name, "touching");
  EXPECT_TRUE(task.failure.name.empty());

  task.Apply("elsewhere");
  EXPECT_EQ(task.robot_base.position[0], 0.1);
  EXPECT_EQ(task.parts[0].pose.position, (std::array<double, 3>{1, 0.1, 0.2}));
  EXPECT_EQ(task.parts[0].pose.quaternion[0], 1) << "a pose is replaced as a whole";
  ASSERT_EQ(task.stages.size(), 2u);
  EXPECT_EQ(task.stages[1].name, "second");
  EXPECT_EQ(task.stages[1].index, 2);
  EXPECT_EQ(task.success.name, "holding");
  EXPECT_EQ(task.failure.name, "touching");
}

TEST_F(VariationTest, MistakesNameTheLine) {
  EXPECT_EQ(Error("      box: {position", "      bax: {position"),
            "t.yaml:19: key 'bax': no part of the scene is called 'bax'; did you mean 'box'?");
  EXPECT_EQ(Error("- name: second", "- name: first"),
            "t.yaml:23: key 'name': another stage is called 'first'");
}

TEST_F(VariationTest, PlacedPartsAreMovedAtResetAndTheirJointsWork) {
  TaskDescription task = Task();
  EXPECT_FALSE(task.parts[0].free);
  EXPECT_TRUE(task.parts[0].placed);
  const RobotDescription robot = LoadRobot(task.robot_file);
  const Scene scene = BuildScene(task, robot);
  const mjModel& model = *scene.physics;
  const int box = mj_name2id(&model, mjOBJ_BODY, "box"), lid = mj_name2id(&model, mjOBJ_BODY, "box/lid");
  EXPECT_EQ(model.nmocap, 1);
  EXPECT_GE(model.body_mocapid[box], 0);
  World world(&model, scene.info, robot, task, 10);

  world.Reset(1, task.variation("base"));
  EXPECT_EQ(world.data().xpos[3 * box], 0.8);
  const int joint = mj_name2id(&model, mjOBJ_JOINT, "box/lid");
  EXPECT_EQ(world.data().qpos[model.jnt_qposadr[joint]], 2) << "joints start at their ref";

  const std::vector<Parameter> parameters = world.Reset(2, task.variation("placed"));
  ASSERT_EQ(parameters.size(), 4u);
  const double yaw = parameters[3].value;
  EXPECT_LE(std::abs(yaw), 30 * std::acos(-1) / 180);
  state_t state{};
  world.Fill(&state);
  EXPECT_EQ(state.body_position_m[static_cast<size_t>(box)][0], parameters[0].value);
  EXPECT_EQ(state.body_position_m[static_cast<size_t>(box)][2], 0.1);
  const auto& q = state.body_quat_wxyz[static_cast<size_t>(box)];
  // On top of the 90 degrees of its pose.
  EXPECT_NEAR(2 * std::atan2(q[3], q[0]), std::acos(0.0) + yaw, 1e-9);
  // What is hinged to it came along.
  EXPECT_NEAR(state.body_position_m[static_cast<size_t>(lid)][0], parameters[0].value, 1e-9);
  EXPECT_NEAR(state.body_position_m[static_cast<size_t>(lid)][2], 0.35, 1e-9);
  // It stays while the world goes on, and goes back at the next reset.
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(world.Step());
  EXPECT_EQ(world.data().xpos[3 * box], parameters[0].value);
  world.Reset(3, task.variation("base"));
  EXPECT_EQ(world.data().xpos[3 * box], 0.8);
  EXPECT_EQ(world.data().xpos[3 * box + 2], 0);
}

TEST_F(VariationTest, DrawsAgainWhereAPartSinksIntoAnother) {
  TaskDescription task =
      ParseTask(ReplaceFirst(TaskText(box_.string()), "objects: [box]\n",
                             "    - {name: block, model: " +
                                 folder_
                                     .Write("block.xml", R"(<mujoco><worldbody>
  <geom type="box" size="0.1 0.1 0.1" mass="1"/></worldbody></mujoco>)")
                                     .string() +
                                 ", pose: {position_m: [0.8, 0, 2]}, free: true}\nobjects: [block]\n"),
                "t.yaml", true);
  const RobotDescription robot = LoadRobot(task.robot_file);
  const Scene scene = BuildScene(task, robot);
  World world(scene.physics.get(), scene.info, robot, task, 10);
  Variation variation;
  // Half of the grid's eight points are within a block's width of the box.
  variation.randomisations = {SpawnPlane{{"block"}, {0.8, 0, 0.1}, {0.1, 0.4}, 0.1, {0, 0, 0}}};
  int beyond = 0;
  for (int seed = 0; seed < 30; ++seed) {
    const std::vector<Parameter> parameters = world.Reset(seed, variation);
    EXPECT_GT(std::abs(parameters[1].value), 0.199) << "seed " << seed;
    beyond += parameters[1].value > 0;
  }
  EXPECT_GT(beyond, 5);
  EXPECT_LT(beyond, 25);
  variation.randomisations = {SpawnPlane{{"block"}, {0.8, 0, 0.1}, {0.1, 0.1}, 0.1, {0, 0, 0}}};
  variation.name = "inside";
  EXPECT_EQ(ErrorOf([&] { world.Reset(0, variation); }),
            "variation 'inside': no draw in 1000 leaves every part clear of the others");

  // The block's centre is 2 m above the box's: 2.5 m apart is 1.5 m aside.
  variation.randomisations = {SpawnBox{"block", {0.8, 0}, {0, 2}, 2.5}};
  beyond = 0;
  for (int seed = 0; seed < 30; ++seed) {
    const std::vector<Parameter> parameters = world.Reset(seed, variation);
    EXPECT_GE(std::abs(parameters[1].value), 1.5) << "seed " << seed;
    beyond += parameters[1].value > 0;
  }
  EXPECT_GT(beyond, 5);
  EXPECT_LT(beyond, 25);
  variation.randomisations = {SpawnBox{"block", {0.8, 0}, {0, 1.4}, 2.5}};
  EXPECT_NE(ErrorOf([&] { world.Reset(0, variation); }).find("no draw in 1000"), std::string::npos);
}

}  // namespace
}  // namespace evalbus::sim
