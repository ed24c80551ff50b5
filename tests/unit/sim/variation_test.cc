// Tests variations that change the scene and the success condition, and parts that are placed at each reset.
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "bus/message.h"
#include "models/scene.h"
#include "sim/world.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::sim::variation_test {

// A box with a hinged lid is fixed to a table. One variation places it elsewhere.
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
    randomize:
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
            "t.yaml:19: key 'bax': the scene has no part 'bax'; did you mean 'box'?");
  EXPECT_EQ(Error("- name: second", "- name: first"),
            "t.yaml:23: key 'name': another stage has the name 'first'");
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
  EXPECT_EQ(state.body[static_cast<size_t>(box)].position_m[0], parameters[0].value);
  EXPECT_EQ(state.body[static_cast<size_t>(box)].position_m[2], 0.1);
  const auto& q = state.body[static_cast<size_t>(box)].quat_wxyz;
  // The drawn angle is added to the 90 degrees of the box's own pose.
  EXPECT_NEAR(2 * std::atan2(q[3], q[0]), std::acos(0.0) + yaw, 1e-9);
  // The hinged lid has moved with the box.
  EXPECT_NEAR(state.body[static_cast<size_t>(lid)].position_m[0], parameters[0].value, 1e-9);
  EXPECT_NEAR(state.body[static_cast<size_t>(lid)].position_m[2], 0.35, 1e-9);
  // The box stays while the simulation runs and returns at the next reset.
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(world.Step());
  EXPECT_EQ(world.data().xpos[3 * box], parameters[0].value);
  world.Reset(3, task.variation("base"));
  EXPECT_EQ(world.data().xpos[3 * box], 0.8);
  EXPECT_EQ(world.data().xpos[3 * box + 2], 0);
}

TEST_F(VariationTest, JointsStartAtTheTasksPositions) {
  TaskDescription task = ParseTask(
      ReplaceFirst(ReplaceFirst(TaskText(box_.string()), "objects: [box]\n",
                                "objects: [box]\njoints: {box/lid: {position_deg: 60}, left/joint1: "
                                "{position_rad: 0.2}}\n"),
                   "  elsewhere:\n",
                   "  ajar:\n    joints: {box/lid: {position_rad: 0.5}}\n  swinging:\n    randomize:\n"
                   "      - spawn_joint: {joint: box/lid, min_deg: 10, max_deg: 20}\n"
                   "      - spawn_joint: {joint: right/joint1, min_rad: -0.1, max_rad: 0.1}\n  elsewhere:\n"),
      "t.yaml", true);
  const RobotDescription robot = LoadRobot(task.robot_file);
  const double degree = std::acos(-1) / 180;
  const auto reset = [&](const std::string& name, int seed) {
    TaskDescription applied = task;
    applied.Apply(name);
    const Scene scene = BuildScene(applied, robot);
    World world(scene.physics.get(), scene.info, robot, applied, 10);
    const std::vector<Parameter> parameters = world.Reset(seed, applied.variation(name));
    const auto joint = [&](const char* joint_name) {
      return world.data()
          .qpos[scene.physics->jnt_qposadr[mj_name2id(scene.physics.get(), mjOBJ_JOINT, joint_name)]];
    };
    EXPECT_EQ(scene.info.arm[0].joint_home_rad[0], 0.2);
    EXPECT_EQ(joint("left/joint1"), 0.2);
    EXPECT_EQ(world.data().ctrl[0], 0.2) << "the arm stays where it starts";
    if (!parameters.empty()) {
      EXPECT_EQ(parameters[0].name, "box/lid_rad");
      EXPECT_EQ(parameters[0].value, joint("box/lid"));
      EXPECT_EQ(parameters[1].value, joint("right/joint1"));
      EXPECT_NE(parameters[1].value, 0);
    }
    return joint("box/lid");
  };
  EXPECT_EQ(reset("base", 0), 60 * degree);
  EXPECT_EQ(reset("ajar", 0), 0.5);
  const double first = reset("swinging", 1), second = reset("swinging", 2);
  EXPECT_NE(first, second);
  EXPECT_EQ(reset("swinging", 1), first);
  for (const double angle : {first, second}) {
    EXPECT_GE(angle, 10 * degree);
    EXPECT_LE(angle, 20 * degree);
  }
  const auto error = [&](const std::string& joints) {
    return ErrorOf([&] {
      BuildScene(ParseTask(ReplaceFirst(TaskText(box_.string()), "objects: [box]\n",
                                        "objects: [box]\njoints: {" + joints + "}\n"),
                           "t.yaml", true),
                 robot);
    });
  };
  EXPECT_EQ(error("box/lit: {position_deg: 1}"),
            "t.yaml:10: joint 'box/lit' is not in the scene; did you mean 'box/lid'?");
  EXPECT_EQ(error("box/lid: {position_m: 1}"),
            "t.yaml:10: joint 'box/lid' is a hinge: its position is in deg or rad");
  EXPECT_EQ(error("box/lid: {position_rad: 2.5}"),
            "t.yaml:10: joint 'box/lid' cannot start at 143.239 degrees (2.5 rad): its range is -57.2958 to "
            "114.592 degrees (-1 to 2 rad)");
  EXPECT_EQ(error("box/lid: {}"),
            "t.yaml:10: key 'box/lid': expected one of position_deg, position_rad, position_m");
}

TEST_F(VariationTest, OnlyPartsOfAnObjectMayBeTouched) {
  const TaskDescription task = ParseTask(ReplaceFirst(TaskText(box_.string()), "objects: [box]\n",
                                                      "objects: [{name: box, may_touch: [box/lid]}]\n"),
                                         "t.yaml", true);
  EXPECT_EQ(task.objects, std::vector<std::string>{"box"});
  const RobotDescription robot = LoadRobot(task.robot_file);
  const Scene scene = BuildScene(task, robot);
  ASSERT_EQ(scene.info.forbidden_contact_geom.size(), 1u);
  const int wall = scene.info.forbidden_contact_geom[0];
  EXPECT_EQ(scene.info.geom_name[static_cast<size_t>(wall)], "box/wall");
  const auto error = [&](const std::string& name) {
    return ErrorOf([&] {
      BuildScene(ParseTask(ReplaceFirst(TaskText(box_.string()), "objects: [box]\n",
                                        "objects: [{name: box, may_touch: [" + name + "]}]\n"),
                           "t.yaml", true),
                 robot);
    });
  };
  const std::string before = "t.yaml:9: object 'box' has no body or geom '", behind = "' with collision; ";
  EXPECT_EQ(error("box/lit"), before + "box/lit" + behind + "did you mean 'box/lid'?");
  EXPECT_EQ(error("lid"), before + "lid" + behind + "did you mean 'box/lid'?");
  EXPECT_EQ(error("hinge"), before + "hinge" + behind +
                                "expected PART/NAME, a body (box, box/lid) or a geom (box/lid, box/wall)");
}

class RandomizedTest : public VariationTest {
 protected:
  // Returns the box's task with two free balls. Its only variation has this list of randomizations.
  TaskDescription TaskWith(const std::string& randomize) {
    const std::string ball = folder_
                                 .Write("ball.xml", R"(<mujoco><worldbody>
  <geom type="sphere" size="0.05" mass="1" friction="0.6 0.01 0.001"/></worldbody></mujoco>)")
                                 .string();
    const auto part = [&](const std::string& name, const char* y) {
      return "    - {name: " + name + ", model: " + ball + ", pose: {position_m: [0.8, " + y +
             ", 0.051]}, free: true}\n";
    };
    std::string text = ReplaceFirst(TaskText(box_.string()), "objects: [box]\n",
                                    part("red", "0.4") + part("blue", "-0.4") + "objects: [box]\n");
    return ParseTask(
        ReplaceFirst(text, "  elsewhere:\n", "  drawn:\n    randomize:\n" + randomize + "  elsewhere:\n"),
        "t.yaml", true);
  }
  std::string ErrorOfList(const std::string& randomize) {
    return ErrorOf([&] { TaskWith(randomize); });
  }
};

// Returns positions and velocities of 100 ticks.
std::vector<double> Played(World* world, int seed, const Variation& variation) {
  world->Reset(seed, variation);
  std::vector<double> values;
  state_t state{};
  for (int tick = 0; tick < 100; ++tick) {
    EXPECT_TRUE(world->Step());
    world->Fill(&state);
    values.insert(values.end(), state.qpos_mixed.begin(), state.qpos_mixed.end());
    values.insert(values.end(), state.qvel_mixed.begin(), state.qvel_mixed.end());
  }
  return values;
}

TEST_F(RandomizedTest, WhatIsSeenChangesNothingOfWhatHappens) {
  const std::string box =
      "      - spawn_box: {object: red, center_m: [0.8, 0.4], half_extents_m: [0.1, 0.1]}\n";
  const TaskDescription plain = TaskWith(box);
  const TaskDescription seen =
      TaskWith("      - color: {of: [red], min_rgb: [0, 0, 0], max_rgb: [1, 1, 1]}\n" + box +
               "      - light: {name: key, min_factor: 0.5, max_factor: 1.5}\n"
               "      - camera: {name: overview, shift_m: [0.1, 0.1, 0.1], turn_deg: 5}\n");
  const RobotDescription robot = LoadRobot(plain.robot_file);
  const Scene scene = BuildScene(plain, robot);
  World a(scene.physics.get(), scene.info, robot, plain, 10),
      b(scene.physics.get(), scene.info, robot, seen, 10);
  for (int seed = 0; seed < 3; ++seed)
    EXPECT_EQ(Played(&a, seed, plain.variation("drawn")), Played(&b, seed, seen.variation("drawn")));

  const auto appearance = [&](int seed) {
    const ModelPtr model(mj_copyModel(nullptr, scene.visual.get()));
    const std::vector<Parameter> parameters = RandomizeAppearance(seen.variation("drawn"), seed, model.get());
    EXPECT_EQ(parameters.size(), 3u + 1 + 6);
    EXPECT_EQ(parameters[0].name, "red_red_fraction");
    const int geom = model->body_geomadr[mj_name2id(model.get(), mjOBJ_BODY, "red")];
    EXPECT_EQ(model->geom_rgba[4 * geom], static_cast<float>(parameters[0].value));
    const int camera = mj_name2id(model.get(), mjOBJ_CAMERA, "overview");
    EXPECT_EQ(parameters[4].name, "camera_overview_shift_x_m");
    EXPECT_EQ(model->cam_pos[3 * camera] - scene.visual->cam_pos[3 * camera],
              scene.visual->cam_pos[3 * camera] + parameters[4].value - scene.visual->cam_pos[3 * camera]);
    EXPECT_LE(std::abs(parameters[4].value), 0.1);
    const int light = mj_name2id(model.get(), mjOBJ_LIGHT, "key");
    EXPECT_FLOAT_EQ(model->light_diffuse[3 * light],
                    scene.visual->light_diffuse[3 * light] * static_cast<float>(parameters[3].value));
    EXPECT_NEAR(mju_norm(model->cam_quat + 4 * camera, 4), 1, 1e-12);
    return parameters[0].value;
  };
  EXPECT_EQ(appearance(1), appearance(1));
  EXPECT_NE(appearance(1), appearance(2));
}

// Textures and poses of lights have their own streams of random numbers.
TEST_F(RandomizedTest, TexturesAndPosesOfLightsChangeNoOtherDraw) {
  const std::string color = "      - color: {of: [red], min_rgb: [0, 0, 0], max_rgb: [1, 1, 1]}\n";
  const std::string camera = "      - camera: {name: overview, shift_m: [0.1, 0.1, 0.1], turn_deg: 5}\n";
  const auto parameters = [&](const std::string& randomize) {
    TaskDescription task = TaskWith(randomize);
    task.Apply("drawn");
    const Scene scene = BuildScene(task, LoadRobot(task.robot_file));
    std::map<std::string, double> values;
    for (const Parameter& parameter : RandomizeAppearance(task.variation("drawn"), 3, scene.visual.get()))
      values[parameter.name] = parameter.value;
    return values;
  };
  const std::map<std::string, double> before =
      parameters(color + "      - light: {name: key, min_factor: 0.5, max_factor: 1.5}\n" + camera);
  const std::string light = "      - light: {name: key, min_factor: 0.5, max_factor: 1.5, turn_deg: 20}\n";
  const std::map<std::string, double> after = parameters(
      color + light + "      - texture: {of: [world], choices: [plain, checker, stripes]}\n" + camera);
  EXPECT_EQ(before.size(), 3U + 1 + 6);
  EXPECT_EQ(after.size(), before.size() + 3 + 1);
  for (const auto& [name, value] : before) EXPECT_EQ(after.at(name), value) << name;
  EXPECT_LE(std::abs(after.at("light_key_turn_y_rad")), 20 * std::numbers::pi / 180);
  // Rotating a light does not change the texture, either.
  const std::map<std::string, double> texture =
      parameters("      - texture: {of: [world], choices: [plain, checker, stripes]}\n");
  EXPECT_EQ(texture.at("world_texture_choice"), after.at("world_texture_choice"));
}

TEST_F(RandomizedTest, ATurnedLightTurnsAboutTheScenesCenter) {
  const TaskDescription task = TaskWith("      - light: {name: key, turn_deg: 30}\n");
  const Scene scene = BuildScene(task, LoadRobot(task.robot_file));
  const mjModel& before = *scene.visual;
  const int key = mj_name2id(&before, mjOBJ_LIGHT, "key");
  const ModelPtr after(mj_copyModel(nullptr, &before));
  const std::vector<Parameter> turn = RandomizeAppearance(task.variation("drawn"), 1, after.get());
  ASSERT_EQ(turn.size(), 3U);
  // Computes the rotation with Rodrigues' formula, independently of MuJoCo's quaternions.
  const double axis[3] = {turn[0].value, turn[1].value, turn[2].value};
  const double angle = mju_norm3(axis);
  const auto rotated = [&](const double* v) {
    double unit[3], cross[3];
    mju_scl3(unit, axis, 1 / angle);
    mju_cross(cross, unit, v);
    const double along = mju_dot3(unit, v);
    std::array<double, 3> result{};
    for (size_t i = 0; i < 3; ++i)
      result[i] =
          v[i] * std::cos(angle) + cross[i] * std::sin(angle) + unit[i] * along * (1 - std::cos(angle));
    return result;
  };
  EXPECT_GT(angle, 0.05);
  const std::array<double, 3> direction = rotated(before.light_dir + 3 * key);
  double arm[3];
  mju_sub3(arm, before.light_pos + 3 * key, before.stat.center);
  const std::array<double, 3> turned_arm = rotated(arm);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(after->light_dir[3 * key + i], direction[static_cast<size_t>(i)], 1e-12);
    EXPECT_NEAR(after->light_pos[3 * key + i] - before.stat.center[i], turned_arm[static_cast<size_t>(i)],
                1e-12);
  }
}

TEST_F(RandomizedTest, ATextureIsThatOfTheSeed) {
  const std::string models = ModelsFolder().string();
  const std::string text = ReplaceFirst(
      TaskText(box_.string()), "objects: [box]\n",
      "    - {name: table, model: " + models + "/props/table/table.xml, pose: {position_m: [2, 0, 0]}}\n" +
          "    - {name: pot, model: " + models +
          "/props/pot/pot.xml, pose: {position_m: [2, 2, 1]}}\nobjects: [box]\n");
  const auto task_with = [&](const std::string& choices, const std::string& part) {
    TaskDescription task = ParseTask(ReplaceFirst(text, "  elsewhere:\n",
                                                  "  drawn:\n    randomize:\n      - texture: {of: [" + part +
                                                      "], choices: " + choices + "}\n  elsewhere:\n"),
                                     "t.yaml", true);
    task.Apply("drawn");
    return task;
  };
  const auto build = [](const TaskDescription& task) { return BuildScene(task, LoadRobot(task.robot_file)); };
  const auto texture_of = [](const mjModel& model, const char* material) {
    const int id = model.mat_texid[mj_name2id(&model, mjOBJ_MATERIAL, material)];
    return std::string(id < 0 ? "plain" : mj_id2name(&model, mjOBJ_TEXTURE, id));
  };
  const std::vector<std::string> choices = {"table/oak", "plain", "marble", "checker"};
  const TaskDescription task = task_with("[table/oak, plain, marble, checker]", "table");
  const Scene scene = build(task);
  std::map<std::string, int> counts;
  for (int seed = 0; seed < 400; ++seed) {
    const ModelPtr model(mj_copyModel(nullptr, scene.visual.get()));
    const std::vector<Parameter> drawn = RandomizeAppearance(task.variation("drawn"), seed, model.get());
    ASSERT_EQ(drawn.size(), 1U);
    EXPECT_EQ(drawn[0].name, "table_texture_choice");
    const std::string texture = texture_of(*model, "table/oak");
    EXPECT_EQ(texture, choices.at(static_cast<size_t>(drawn[0].value)));
    // The table's other materials have no texture before and after.
    EXPECT_EQ(texture_of(*model, "table/frame"), "plain");
    ++counts[texture];
  }
  // Each count has a standard deviation of sqrt(400 / 4 * 3 / 4) = 8.7.
  for (const std::string& choice : choices) EXPECT_NEAR(counts[choice], 100, 35) << choice;
  EXPECT_EQ(ParameterChoices(task.variation("drawn")).at("table_texture_choice"), choices);

  // If a part has no texture, all of its materials get one.
  const TaskDescription pot = task_with("[stripes, dots]", "pot");
  const Scene pot_scene = build(pot);
  RandomizeAppearance(pot.variation("drawn"), 1, pot_scene.visual.get());
  for (const char* material : {"pot/steel", "pot/handle"})
    EXPECT_NE(texture_of(*pot_scene.visual, material), "plain");

  const auto error = [&](const std::string& names, const std::string& part) {
    return ErrorOf([&] {
      const TaskDescription wrong = task_with(names, part);
      RandomizeAppearance(wrong.variation("drawn"), 0, build(wrong).visual.get());
    });
  };
  EXPECT_EQ(error("[oak, checker]", "table"),
            "t.yaml:20: the scene has no texture 'oak'; besides its own, there are checker, concrete, dots, "
            "marble, "
            "plain, stripes, tiles, and files that end in .png");
  EXPECT_EQ(error("[backdrop, checker]", "table"),
            "t.yaml:20: texture 'backdrop' is a cube or a sky: only textures of type 2d can be exchanged");
  EXPECT_EQ(error("[plain, checker]", "box"), "t.yaml:20: 'box' has no material, which a texture requires");
  EXPECT_TRUE(error("[plain, none.png]", "table").ends_with("none.png does not exist"));
}

TEST_F(RandomizedTest, MassAndFrictionAreThoseOfTheSeed) {
  const TaskDescription task = TaskWith(
      "      - mass: {of: [red, blue], min_factor: 0.5, max_factor: 2}\n"
      "      - friction: {of: [red, left/hand/left_finger], min_factor: 0.1, max_factor: 0.9}\n");
  const RobotDescription robot = LoadRobot(task.robot_file);
  const Scene scene = BuildScene(task, robot);
  const mjModel& compiled = *scene.physics;
  World world(&compiled, scene.info, robot, task, 10);
  const int red = mj_name2id(&compiled, mjOBJ_BODY, "red"), blue = mj_name2id(&compiled, mjOBJ_BODY, "blue");
  const int box = mj_name2id(&compiled, mjOBJ_BODY, "box/lid");
  const int finger = compiled.body_geomadr[mj_name2id(&compiled, mjOBJ_BODY, "left/hand/left_finger")];
  const auto reset = [&](int seed) {
    const std::vector<Parameter> parameters = world.Reset(seed, task.variation("drawn"));
    EXPECT_EQ(parameters.size(), 2u);
    EXPECT_EQ(parameters[0].name, "red_mass_factor");
    EXPECT_EQ(parameters[1].name, "red_friction_factor");
    const mjModel& model = world.model();
    const double mass = parameters[0].value, friction = parameters[1].value;
    for (const int body : {red, blue}) {
      EXPECT_DOUBLE_EQ(model.body_mass[body], mass);
      // The inertia of a ball of this mass and 5 cm radius is 2/5 m r^2.
      EXPECT_NEAR(model.body_inertia[3 * body], 0.4 * mass * 0.05 * 0.05, 1e-12);
      // The inverse weight along each axis is 1/m.
      EXPECT_NEAR(model.dof_invweight0[model.body_dofadr[body]], 1 / mass, 1e-9);
    }
    EXPECT_EQ(model.body_mass[box], compiled.body_mass[box]);
    EXPECT_DOUBLE_EQ(model.geom_friction[3 * model.body_geomadr[red]], 0.6 * friction);
    EXPECT_EQ(model.geom_friction[3 * model.body_geomadr[blue]], 0.6);
    EXPECT_DOUBLE_EQ(model.geom_friction[3 * finger], compiled.geom_friction[3 * finger] * friction);
    return mass;
  };
  const double first = reset(1);
  EXPECT_NE(reset(2), first);
  EXPECT_EQ(reset(1), first) << "what the episode before drew is forgotten";
  EXPECT_EQ(Played(&world, 1, task.variation("drawn")), Played(&world, 1, task.variation("drawn")));
  world.Reset(1, task.variation("base"));
  EXPECT_EQ(world.model().body_mass[red], 1);
}

TEST_F(RandomizedTest, DistractorsAreThereOrFarAway) {
  const TaskDescription task = TaskWith(
      "      - distractors: {objects: [red, blue], center_m: [0.8, 0.4], half_extents_m: [0.1, 0.2], "
      "max_count: 1}\n");
  const RobotDescription robot = LoadRobot(task.robot_file);
  const Scene scene = BuildScene(task, robot);
  World world(scene.physics.get(), scene.info, robot, task, 10);
  std::map<std::string, int> seen;
  for (int seed = 0; seed < 30; ++seed) {
    const std::vector<Parameter> parameters = world.Reset(seed, task.variation("drawn"));
    if (parameters.empty()) ++seen["none"];
    for (int tick = 0; tick < 50; ++tick) ASSERT_TRUE(world.Step());
    for (const std::string name : {"red", "blue"}) {
      const double* p = world.data().xpos + 3 * mj_name2id(&world.model(), mjOBJ_BODY, name.c_str());
      const bool is_there = !parameters.empty() && parameters[0].name == name + "_x_m";
      seen[name] += is_there;
      if (is_there) {
        EXPECT_EQ(parameters.size(), 3u);
        EXPECT_NEAR(p[0], parameters[0].value, 1e-3);
        EXPECT_LE(std::abs(p[0] - 0.8), 0.101);
        EXPECT_LE(std::abs(p[1] - 0.4), 0.201);
        EXPECT_NEAR(p[2], 0.05, 2e-3);
      } else {
        EXPECT_NEAR(p[0], 100, 1e-9);
        EXPECT_NEAR(p[2], 10, 1e-9) << "floats";
      }
    }
  }
  // An episode has none or one of the balls. No ball, red and blue all occur.
  EXPECT_GT(seen["none"], 7);
  EXPECT_GT(seen["red"], 2);
  EXPECT_GT(seen["blue"], 2);
}

TEST_F(RandomizedTest, ALampIsShiftedByWhatIsRecorded) {
  const TaskDescription task = TaskWith("      - light: {name: key, shift_m: [0.1, 0.2, 0.3]}\n");
  const Scene scene = BuildScene(task, LoadRobot(task.robot_file));
  const int key = mj_name2id(scene.visual.get(), mjOBJ_LIGHT, "key");
  scene.visual->light_directional[key] = false;
  const ModelPtr drawn(mj_copyModel(nullptr, scene.visual.get()));
  const std::vector<Parameter> parameters = RandomizeAppearance(task.variation("drawn"), 3, drawn.get());
  ASSERT_EQ(parameters.size(), 3u);
  const double most[] = {0.1, 0.2, 0.3};
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(parameters[i].name, std::string("light_key_shift_") + "xyz"[i] + "_m");
    EXPECT_NE(parameters[i].value, 0);
    EXPECT_LE(std::abs(parameters[i].value), most[i]);
    const size_t at = 3 * static_cast<size_t>(key) + i;
    EXPECT_DOUBLE_EQ(drawn->light_pos[at], scene.visual->light_pos[at] + parameters[i].value);
  }
}

TEST_F(RandomizedTest, CamerasThatFollowABodyAreRefused) {
  const auto error = [&](const std::string& change, mjtCamLight mode) {
    const TaskDescription task = TaskWith("      - camera: {name: overview, " + change + "}\n");
    const Scene scene = BuildScene(task, LoadRobot(task.robot_file));
    scene.visual->cam_mode[mj_name2id(scene.visual.get(), mjOBJ_CAMERA, "overview")] = mode;
    return ErrorOf([&] { RandomizeAppearance(task.variation("drawn"), 0, scene.visual.get()); });
  };
  const std::string shift = "shift_m: [1, 0, 0]", turn = "turn_deg: 5";
  EXPECT_EQ(error(shift, mjCAMLIGHT_FIXED), "(no error)");
  EXPECT_EQ(error(turn, mjCAMLIGHT_FIXED), "(no error)");
  for (const mjtCamLight mode : {mjCAMLIGHT_TRACK, mjCAMLIGHT_TRACKCOM}) {
    EXPECT_EQ(error(shift, mode),
              "t.yaml:20: camera 'overview' tracks a body, so it can neither be shifted nor turned");
  }
  EXPECT_EQ(error(shift, mjCAMLIGHT_TARGETBODY), "(no error)");
  EXPECT_EQ(error(turn, mjCAMLIGHT_TARGETBODY),
            "t.yaml:20: camera 'overview' looks at a body, so it cannot be turned");
}

TEST_F(RandomizedTest, MistakesNameTheLine) {
  EXPECT_EQ(ErrorOfList("      - size: {of: [red], min_factor: 1, max_factor: 2}\n"),
            "t.yaml:20: key 'size': sizes cannot be randomized, because shapes and inertias are compiled "
            "into the model: "
            "give variations parts of different sizes");
  EXPECT_EQ(ErrorOfList("      - mass: {of: [red], min_factor: 0, max_factor: 2}\n"),
            "t.yaml:20: key 'min_factor': expected a number in [0.001, 1000], got '0'");
  EXPECT_EQ(ErrorOfList("      - friction: {of: [red], min_factor: 2, max_factor: 1}\n"),
            "t.yaml:20: key 'max_factor': expected at least min_factor");
  EXPECT_EQ(ErrorOfList("      - color: {of: [], min_rgb: [0, 0, 0], max_rgb: [1, 1, 1]}\n"),
            "t.yaml:20: key 'of': expected at least one part or body");
  EXPECT_EQ(ErrorOfList("      - light: {name: key, min_factor: 1}\n"),
            "t.yaml:20: key 'light': expected both min_factor and max_factor, or neither");
  EXPECT_EQ(ErrorOfList("      - light: {name: key}\n"),
            "t.yaml:20: key 'light': expected min_factor and max_factor, shift_m, turn_deg or turn_rad");
  EXPECT_EQ(ErrorOfList("      - camera: {name: overview}\n"),
            "t.yaml:20: key 'camera': expected shift_m, turn_deg or turn_rad above 0");
  EXPECT_EQ(ErrorOf([&] {
              TaskDescription heavy = TaskWith("      - mass: {of: [red], min_factor: 1, max_factor: 2}\n");
              std::ranges::find(heavy.parts, "red", &ScenePart::name)->free = false;
              const Scene still = BuildScene(heavy, LoadRobot(heavy.robot_file));
              RandomizePhysics(heavy.variation("drawn"), 0, still.physics.get());
            }),
            "t.yaml:20: part 'red' is fixed, so its mass has no effect");
  EXPECT_EQ(ErrorOf([&] {
              const TaskDescription drawn =
                  TaskWith("      - friction: {of: [red], min_factor: 1, max_factor: 2}\n");
              const Scene bare = BuildScene(drawn, LoadRobot(drawn.robot_file));
              mjModel& model = *bare.physics;
              const int red = mj_name2id(&model, mjOBJ_BODY, "red");
              std::replace(model.geom_bodyid, model.geom_bodyid + model.ngeom, red, 0);
              RandomizePhysics(drawn.variation("drawn"), 0, &model);
            }),
            "t.yaml:20: part or body 'red' has no geom that collides, so its friction has no effect");
  EXPECT_EQ(ErrorOf([&] {
              const TaskDescription drawn =
                  TaskWith("      - color: {of: [red], min_rgb: [0, 0, 0], max_rgb: [1, 1, 1]}\n");
              const Scene bare = BuildScene(drawn, LoadRobot(drawn.robot_file));
              mjModel& model = *bare.visual;
              const int red = mj_name2id(&model, mjOBJ_BODY, "red");
              std::replace(model.geom_bodyid, model.geom_bodyid + model.ngeom, red, 0);
              RandomizeAppearance(drawn.variation("drawn"), 0, &model);
            }),
            "t.yaml:20: part or body 'red' has no geom, so its color has no effect");
  EXPECT_EQ(ErrorOf([&] {
              const TaskDescription narrow = TaskWith(
                  "      - spawn_plane: {objects: [red, blue], origin_m: [0.8, 0, 0.1], "
                  "half_extents_m: [0.05, 0.05], spacing_m: 0.1}\n");
              const RobotDescription robot = LoadRobot(narrow.robot_file);
              const Scene scene = BuildScene(narrow, robot);
              World world(scene.physics.get(), scene.info, robot, narrow, 10);
              world.Reset(0, narrow.variation("drawn"));
            }),
            "t.yaml:20: spawn_plane: expected at least one grid point per object, got 1 point for 2 objects");
  EXPECT_EQ(ErrorOfList("      - texture: {of: [red], choices: [checker]}\n"),
            "t.yaml:20: key 'choices': expected at least two textures");
  EXPECT_EQ(ErrorOfList("      - texture: {of: [red], choices: [checker, checker]}\n"),
            "t.yaml:20: key 'choices[1]': 'checker' given twice");
  EXPECT_EQ(ErrorOf([&] {
              const TaskDescription shifted = TaskWith("      - light: {name: key, shift_m: [1, 1, 1]}\n");
              const Scene lit = BuildScene(shifted, LoadRobot(shifted.robot_file));
              RandomizeAppearance(shifted.variation("drawn"), 0, lit.visual.get());
            }),
            "t.yaml:20: light 'key' is directional, so its position does not matter: use turn_deg");
  EXPECT_EQ(ErrorOfList("      - distractors: {objects: [box], center_m: [0, 0], half_extents_m: [1, 1]}\n"),
            "t.yaml:8: part 'box' is a distractor of a variation, which requires 'free: true'");
  EXPECT_EQ(ErrorOfList("      - spawn_bx: {}\n"),
            "t.yaml:20: key 'spawn_bx': unknown key here; did you mean 'spawn_box'?");
  const TaskDescription task =
      TaskWith("      - color: {of: [rad], min_rgb: [0, 0, 0], max_rgb: [1, 1, 1]}\n");
  const Scene scene = BuildScene(task, LoadRobot(task.robot_file));
  EXPECT_EQ(ErrorOf([&] { RandomizeAppearance(task.variation("drawn"), 0, scene.visual.get()); }),
            "t.yaml:20: the scene has no part or body 'rad'");
}

TEST_F(VariationTest, FindsWhatStartsSunkIntoSomething) {
  const auto overlap = [&](const std::string& from, const std::string& to, const std::string& variation) {
    TaskDescription task = ParseTask(ReplaceFirst(TaskText(box_.string()), from, to), "t.yaml", true);
    task.Apply(variation);
    const RobotDescription robot = LoadRobot(task.robot_file);
    const Scene scene = BuildScene(task, robot);
    World world(scene.physics.get(), scene.info, robot, task, 10);
    world.Reset(0, task.variation(variation));
    const state_t before = [&] {
      state_t state{};
      world.Fill(&state);
      return state;
    }();
    const std::string found = world.Overlap();
    EXPECT_EQ(found, world.Overlap());
    state_t after{};
    world.Fill(&after);
    EXPECT_EQ(Encode(before), Encode(after));
    return found;
  };
  EXPECT_EQ(overlap("", "", "base"), "");
  // MuJoCo itself does not check this pair, because both parts are fixed.
  const std::string found =
      overlap("position_m: [0.8, 0, 0], yaw_deg: 90", "position_m: [0, 0.3, 0.5], yaw_deg: 90", "base");
  EXPECT_TRUE(found.starts_with("box is ") && found.ends_with(" mm deep in left")) << found;
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
  // The grid has 2 x 8 points. At the four middle positions along y, the block would overlap the box.
  variation.randomizations = {SpawnPlane{{"block"}, {0.8, 0, 0.1}, {0.1, 0.4}, 0.1, {0, 0, 0}}};
  int beyond = 0;
  for (int seed = 0; seed < 30; ++seed) {
    const std::vector<Parameter> parameters = world.Reset(seed, variation);
    EXPECT_GT(std::abs(parameters[1].value), 0.199) << "seed " << seed;
    beyond += parameters[1].value > 0;
  }
  EXPECT_GT(beyond, 5);
  EXPECT_LT(beyond, 25);
  variation.randomizations = {SpawnPlane{{"block"}, {0.8, 0, 0.1}, {0.1, 0.1}, 0.1, {0, 0, 0}}};
  variation.name = "inside";
  variation.location = {"t.yaml", 7};
  const std::string message = ErrorOf([&] { world.Reset(0, variation); });
  EXPECT_TRUE(message.starts_with(
      "t.yaml:7: variation 'inside': none of 1000 draws keeps all parts apart; in the last one, "
      "block is "))
      << message;
  EXPECT_TRUE(message.ends_with(" mm deep in box")) << message;

  // The block's center is 2 m above the box's center, so a distance of 2.5 m is 1.5 m sideways.
  variation.randomizations = {SpawnBox{"block", {0.8, 0}, {0, 2}, 2.5}};
  beyond = 0;
  for (int seed = 0; seed < 30; ++seed) {
    const std::vector<Parameter> parameters = world.Reset(seed, variation);
    EXPECT_GE(std::abs(parameters[1].value), 1.5) << "seed " << seed;
    beyond += parameters[1].value > 0;
  }
  EXPECT_GT(beyond, 5);
  EXPECT_LT(beyond, 25);
  variation.randomizations = {SpawnBox{"block", {0.8, 0}, {0, 1.4}, 2.5}};
  EXPECT_NE(ErrorOf([&] { world.Reset(0, variation); }).find(" m from box, expected at least 2.5 m"),
            std::string::npos);
}

}  // namespace evalbus::sim::variation_test
