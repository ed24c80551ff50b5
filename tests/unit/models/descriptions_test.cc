#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "models/robot_description.h"
#include "models/task_description.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::descriptions_test {

// Returns the line number of `part` in `text`.
int LineOf(const std::string& text, const std::string& part) {
  const size_t at = text.find(part);
  EXPECT_NE(at, std::string::npos) << part;
  return 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<long>(at), '\n'));
}

constexpr const char* kRobot = R"(name: small
arms:
  - name: left
    model: newer_arm.xml
    joints: [joint1, joint2]
    actuators: [motor1, motor2]
    wrist_site: wrist
    home_rad: [0, 0.5]
    gripper:
      model: newer_hand.xml
      attach_body: flange
      joints: [slide1, slide2]
      joint_open_m: 0.04
      joint_closed_m: 0
      actuator: grip
      command_open: 255
      command_closed: 0
      pad_bodies: [left_finger, right_finger]
)";

// Returns the error of kRobot with one change, as "LINE: message".
std::string RobotError(const std::string& from, const std::string& to) {
  TempFolder folder;
  const auto file = folder.Write("r.yaml", ReplaceFirst(kRobot, from, to));
  std::string message = ErrorOf([&] { LoadRobot(file, {.model_path = {kModelsData}}); });
  const std::string prefix = file.string() + ":";
  EXPECT_EQ(message.substr(0, prefix.size()), prefix) << message;
  return message.substr(std::min(prefix.size(), message.size()));
}

TEST(RobotDescription, Small) {
  TempFolder folder;
  const RobotDescription robot = LoadRobot(folder.Write("r.yaml", kRobot), {.model_path = {kModelsData}});
  EXPECT_EQ(robot.name, "small");
  ASSERT_EQ(robot.arms.size(), 1u);
  const ArmDescription& arm = robot.arms[0];
  EXPECT_EQ(arm.model_file, kModelsData / "newer_arm.xml");
  EXPECT_EQ(arm.joints, (std::vector<std::string>{"joint1", "joint2"}));
  EXPECT_EQ(arm.home, (std::vector<double>{0, 0.5}));
  EXPECT_TRUE(arm.position_gain.empty());
  const GripperDescription& gripper = robot.grippers[0];
  EXPECT_EQ(gripper.arm, "left");
  EXPECT_EQ(gripper.attach_body, "flange");
  EXPECT_EQ(gripper.joint_open, 0.04);
  EXPECT_EQ(gripper.command_open, 255);
  EXPECT_LT(gripper.joint_damping, 0);
}

TEST(RobotDescription, MistakesNameTheLine) {
  EXPECT_EQ(RobotError("joint2]", "joint9]"),
            "5: key 'joints[1]': newer_arm.xml has no joint 'joint9'; did you mean 'joint1'?");
  EXPECT_EQ(RobotError("motor2]", "slow]"),
            "6: key 'actuators[1]': newer_arm.xml has no actuator 'slow'; expected one of motor1, motor2");
  EXPECT_EQ(RobotError(", motor2]", "]"), "6: key 'actuators': expected one per joint, 2, got 1");
  EXPECT_EQ(RobotError("motor2]", "motor1]"), "6: key 'actuators[1]': 'motor1' given twice");
  EXPECT_EQ(RobotError("wrist_site: wrist", "wrist_site: elbow"),
            "7: key 'wrist_site': newer_arm.xml has no site 'elbow'; expected one of wrist");
  EXPECT_EQ(RobotError("[0, 0.5]", "[0]"), "8: key 'home_rad': expected a list of 2 numbers, got 1");
  EXPECT_EQ(RobotError("home_rad", "home"), "8: key 'home': unknown key here; did you mean 'home_rad'?");
  EXPECT_EQ(RobotError("body: flange", "body: flang"),
            "11: key 'attach_body': newer_arm.xml has no body 'flang'; did you mean 'flange'?");
  EXPECT_EQ(RobotError("      attach_body: flange\n", ""),
            "9: key 'gripper': a gripper with its own model requires 'attach_body'");
  EXPECT_EQ(RobotError("slide2]", "joint1]"),
            "12: key 'joints[1]': newer_hand.xml has no joint 'joint1'; expected one of slide1, slide2");
  EXPECT_EQ(RobotError("      joint_open_m: 0.04\n", ""),
            "9: key 'gripper': expected either 'joint_open_m' and 'joint_closed_m', or 'joint_open_rad' and "
            "'joint_closed_rad'");
  EXPECT_EQ(RobotError("joint_closed_m: 0", "joint_closed_rad: 0"),
            "9: key 'gripper': expected either 'joint_open_m' and 'joint_closed_m', or 'joint_open_rad' and "
            "'joint_closed_rad'");
  EXPECT_EQ(RobotError("closed_m: 0", "closed_m: 0.04"),
            "9: key 'gripper': joint_open and joint_closed must differ");
  EXPECT_EQ(RobotError("command_closed: 0", "command_closed: 255"),
            "17: key 'command_closed': must differ from command_open");
  EXPECT_EQ(RobotError("right_finger]", "thumb]"),
            "18: key 'pad_bodies[1]': newer_hand.xml has no body 'thumb'; expected one of hand, left_finger, "
            "right_finger");
  EXPECT_EQ(RobotError("    wrist_site: wrist\n", ""),
            "3: key 'wrist_site': required here, but missing in 'arms[0]'");
  EXPECT_EQ(RobotError("name: left", "name: left/arm"),
            "3: key 'name': expected a name of letters, digits and underscores, got 'left/arm'");
  EXPECT_EQ(RobotError("name: left", "name: any"),
            "3: key 'name': conditions of tasks use 'any' for other arms");
}

TEST(RobotDescription, ModelsAreLookedForInTheModelPath) {
  TempFolder folder;
  const auto file = folder.Write("r.yaml", kRobot);
  EXPECT_EQ(ErrorOf([&] { LoadRobot(file, {.model_path = {"/nowhere"}}); }),
            file.string() + ":4: key 'model': file 'newer_arm.xml' not found in " + folder.path().string() +
                ", /nowhere, " + (ModelsFolder() / "robots").string() +
                "; --model-path FOLDER names further folders");
  EXPECT_EQ(ErrorOf([] { LoadRobot("/nowhere/r.yaml"); }),
            "/nowhere/r.yaml: cannot read the robot description: No such file or directory");
}

TEST(RobotDescription, Shipped) {
  const RobotDescription two = LoadRobot(ModelsFolder() / "robots/bimanual_panda.yaml");
  ASSERT_EQ(two.arms.size(), 2u);
  EXPECT_EQ(two.arms[0].name, "left");
  EXPECT_EQ(two.arms[0].base.position, (std::array<double, 3>{0, 0.3, 0.6}));
  EXPECT_EQ(two.arms[1].name, "right");
  EXPECT_EQ(two.arms[1].base.position, (std::array<double, 3>{0, -0.3, 0.6}));
  EXPECT_EQ(two.arms[1].joints.size(), 7u);
  EXPECT_EQ(two.grippers[1].arm, "right");
  EXPECT_EQ(LoadRobot(ModelsFolder() / "robots/single_panda.yaml").arms.size(), 1u);
  // Menagerie's models are not part of the repository, so their files are missing.
  const std::string robots = (ModelsFolder() / "robots").lexically_normal();
  EXPECT_EQ(ErrorOf([&] { LoadRobot(robots + "/bimanual_panda_menagerie.yaml"); }),
            robots +
                "/bimanual_panda_menagerie.yaml:12: key 'model': file "
                "'franka_emika_panda/panda_nohand.xml' not found in " +
                robots + "; --model-path FOLDER names further folders");
}

TEST(FindRobot, ByNameOrFile) {
  EXPECT_EQ(FindRobot("single_panda"), ModelsFolder() / "robots/single_panda.yaml");
  EXPECT_EQ(FindRobot("elsewhere/mine.yaml"), "elsewhere/mine.yaml");
  EXPECT_EQ(ErrorOf([] { FindRobot("single_pand"); }),
            "unknown robot 'single_pand'; did you mean 'single_panda'?");
}

constexpr const char* kTask = R"(name: push
title: Push the block
robot:
  file: newer_robot.yaml
time_limit_s: 10
scene:
  base: world.xml
  parts:
    - name: block
      model: everything.xml
      pose: {position_m: [1, 0, 0]}
objects: [block]
variations:
  base: {}
  wide:
    alias: PushWide
    randomize:
      - spawn_box: {object: block, center_m: [0, 1], half_extents_m: [2, 3], min_distance_m: 0.1}
      - spawn_plane:
          objects: [block]
          origin_m: [1, 2, 3]
          half_extents_m: [1, 1]
          spacing_m: 0.5
          jitter_m: [0, 0.1, 0]
      - spawn_yaw: {object: block, bound_deg: 90}
stages:
  - name: touched
    when: {holding: {gripper: left, object: block}}
success:
  all:
    - not: {touching: {a: block, b: world}}
    - facing: {object: block, direction: [0, 0, 1]}
)";

TaskDescription Parse(const std::string& text) { return ParseTask(text, "t.yaml", false); }

std::string TaskError(const std::string& from, const std::string& to) {
  const std::string text = ReplaceFirst(kTask, from, to);
  const std::string message = ErrorOf([&] { Parse(text); });
  EXPECT_EQ(message.substr(0, 7), "t.yaml:") << message;
  return message.substr(7);
}

TEST(TaskDescription, Small) {
  const TaskDescription task = Parse(kTask);
  EXPECT_EQ(task.name, "push");
  EXPECT_EQ(task.text, kTask);
  EXPECT_EQ(task.robot_file, std::filesystem::current_path() / "newer_robot.yaml");
  EXPECT_EQ(task.time_limit, 10);
  ASSERT_EQ(task.parts.size(), 1u);
  EXPECT_FALSE(task.parts[0].free);
  EXPECT_EQ(task.parts[0].location.line, 9);
  ASSERT_EQ(task.variations.size(), 2u);
  EXPECT_TRUE(task.variation("base").randomizations.empty());
  const auto& random = task.variation("wide").randomizations;
  ASSERT_EQ(random.size(), 3u);
  EXPECT_EQ(std::get<SpawnBox>(random[0]).half_extents[1], 3);
  EXPECT_EQ(std::get<SpawnPlane>(random[1]).jitter[1], 0.1);
  EXPECT_NEAR(std::get<SpawnYaw>(random[2]).bound, std::acos(0.0), 1e-15);
  EXPECT_EQ(task.metrics.slip_sample_window, 20);
  EXPECT_TRUE(task.failure.name.empty());
  EXPECT_EQ(ErrorOf([&] { task.variation("wider"); }),
            "task push has no variation 'wider'; did you mean 'wide'?");
}

TEST(TaskDescription, ExpressionsAreTrees) {
  const TaskDescription task = Parse(kTask);
  EXPECT_EQ(task.stages[0].index, 1);
  EXPECT_EQ(task.stages[0].when.name, "holding");
  const YamlMap arguments(task.stages[0].when.arguments, {"gripper", "object"});
  EXPECT_EQ(arguments["object"].Text(), "block");
  const Expression& success = task.success;
  EXPECT_EQ(success.name, "all");
  ASSERT_EQ(success.operands.size(), 2u);
  EXPECT_EQ(success.operands[0].name, "not");
  ASSERT_EQ(success.operands[0].operands.size(), 1u);
  EXPECT_EQ(success.operands[0].operands[0].name, "touching");
  EXPECT_TRUE(success.operands[1].operands.empty());
  const YamlMap facing(success.operands[1].arguments, {"object", "direction"});
  EXPECT_EQ((facing["direction"].Vector<3>()), (std::array<double, 3>{0, 0, 1}));
  EXPECT_EQ(success.operands[1].location().ToString(), "t.yaml:" + std::to_string(LineOf(kTask, "facing")));
}

TEST(TaskDescription, AliasesDiffer) {
  const std::string error =
      ErrorOf([] { Parse(ReplaceFirst(kTask, "  base: {}", "  base: {alias: PushWide}")); });
  EXPECT_NE(error.find("key 'alias': variation 'base' already has this alias"), std::string::npos) << error;
  const std::string name = ErrorOf([] { Parse(ReplaceFirst(kTask, "alias: PushWide", "alias: base")); });
  EXPECT_NE(name.find("an alias of one is the name of the other"), std::string::npos) << name;
}

TEST(TaskDescription, AVariationsConditionsAreItsOwn) {
  const TaskDescription task = Parse(ReplaceFirst(
      kTask, "    alias: PushWide", "    alias: PushWide\n    success: {touching: {a: block, b: left}}"));
  TaskDescription wide = task, base = task;
  wide.Apply("wide");
  base.Apply("base");
  EXPECT_EQ(wide.success.name, "touching");
  EXPECT_EQ(YamlMap(wide.success.arguments, {"a", "b"})["b"].Text(), "left");
  for (const TaskDescription& other : {task, base}) {
    EXPECT_EQ(other.success.name, "all");
    EXPECT_TRUE(other.success.arguments.is_list());
  }
}

TEST(TaskDescription, NamedAndSingleQuantities) {
  const auto distances = [](const std::string& text) {
    return Parse(std::string(kTask) + "target_distance: " + text + "\n").target_distance;
  };
  const auto named = distances("{up: {lift: {object: block}}, near: {distance: {a: left, b: block}}}");
  ASSERT_EQ(named.size(), 2u);
  EXPECT_EQ(named[0].name, "up");
  EXPECT_EQ(named[0].expression.name, "lift");
  EXPECT_EQ(YamlMap(named[1].expression.arguments, {"a", "b"})["b"].Text(), "block");
  for (const char* text : {"{lift: {object: block}}", "{distance: {a: left, b: block}}", "{constant: 0.3}"}) {
    const auto single = distances(text);
    ASSERT_EQ(single.size(), 1u) << text;
    EXPECT_EQ(single[0].name, "") << text;
    EXPECT_EQ(single[0].expression.operands.size(), 0u) << text;
  }
  const auto one = distances("{up: {lift: {object: block}}}");
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].name, "up");
}

TEST(TaskDescription, MistakesNameTheLine) {
  EXPECT_EQ(TaskError("time_limit_s: 10", "time_limit: 10"),
            "5: key 'time_limit': unknown key here; did you mean 'time_limit_s'?");
  for (const std::string seconds : {"0", "1e-320", "9223372036854775808", "1e308"}) {
    EXPECT_EQ(TaskError("limit_s: 10", "limit_s: " + seconds),
              "5: key 'time_limit_s': expected a number in [0.001, 1e+06], got '" + seconds + "'");
  }
  EXPECT_EQ(TaskError("success:", "failure:"), "1: key 'success': required here, but missing");
  EXPECT_EQ(TaskError("position_m: [1, 0, 0]", "position_m: [1, 0]"),
            "11: key 'position_m': expected a list of 3 numbers, got 2");
  EXPECT_EQ(TaskError("objects: [block]", "objects: [blok]"),
            "12: key 'objects[0]': the scene has no part 'blok'; did you mean 'block'?");
  EXPECT_EQ(TaskError("- name: block", "- name: world"),
            "9: key 'name': 'world' is reserved; choose another name");
  EXPECT_EQ(TaskError("spawn_yaw: {object: block", "spawn_yaw: {object: rock"),
            "25: key 'object': the scene has no part 'rock'; expected one of block");
  EXPECT_EQ(TaskError("bound_deg: 90", "bound_deg: 190"),
            "25: key 'bound_deg': expected a number in [0, 180], got '190'");
  EXPECT_EQ(TaskError(", bound_deg: 90", ""), "25: key 'spawn_yaw': expected 'bound_deg' or 'bound_rad'");
  EXPECT_NE(TaskError("center_m: [0, 1]", "center_m: [0, 1e30]").find("a number in [-10, 10]"),
            std::string::npos);
  EXPECT_EQ(TaskError("spawn_box", "spawn_bocks"),
            "18: key 'spawn_bocks': unknown key here; did you mean 'spawn_box'?");
  EXPECT_EQ(TaskError("spacing_m: 0.5", "spacing_m: 0"),
            "23: key 'spacing_m': expected a number > 0, got '0'");
  EXPECT_EQ(TaskError("spacing_m: 0.5", "spacing_m: 1e-5"),
            "23: key 'spacing_m': expected a grid of at most 1000 by 1000 points");
  EXPECT_EQ(TaskError("spacing_m: 0.5", "spacing_m: 1e-300"),
            "23: key 'spacing_m': expected a grid of at most 1000 by 1000 points");
  EXPECT_EQ(TaskError("    when: {holding: {gripper: left, object: block}}", "    when: holding"),
            "28: key 'when': expected one expression such as {holding: {gripper: left, object: pot}}");
  EXPECT_EQ(TaskError("{gripper: left, object: block}", "{gripper: left, object: {name: block}}"),
            "28: key 'object': expected text, got a map");
  EXPECT_EQ(TaskError("{gripper: left, object: block}", "{gripper: left, gripper: left}"),
            "28: key 'gripper': given twice, first in line 28");
  EXPECT_EQ(TaskError("base: {}", "base: {}\n  base: {}"), "15: key 'base': given twice, first in line 14");
  EXPECT_EQ(ErrorOf([] { Parse(std::string(kTask) + "metrics: {track_jerk: true}\n"); }).substr(0, 46),
            "t.yaml:33: key 'track_jerk': unknown key here;");
  EXPECT_EQ(ErrorOf([] { Parse(std::string(kTask) + "metrics: {slip_sample_window_ticks: 0}\n"); }),
            "t.yaml:33: key 'slip_sample_window_ticks': expected a whole number >= 1, got '0'");
}

TEST(TaskDescription, StagesAreOptional) {
  const std::string text = kTask;
  const size_t stages = text.find("stages:"), success = text.find("success:");
  EXPECT_TRUE(Parse(text.substr(0, stages) + text.substr(success)).stages.empty());
}

TEST(TaskDescription, AVariationCanRemoveStagesAndDistances) {
  const TaskDescription task = Parse(ReplaceFirst(
      kTask, "    alias: PushWide", "    alias: PushWide\n    stages: []\n    target_distance: {}"));
  TaskDescription wide = task, base = task;
  wide.Apply("wide");
  base.Apply("base");
  EXPECT_TRUE(wide.stages.empty());
  EXPECT_TRUE(wide.target_distance.empty());
  EXPECT_EQ(base.stages.size(), task.stages.size());
  EXPECT_FALSE(base.stages.empty());
}

TEST(TaskDescription, AVariationHasItsOwnInstructionAndCameras) {
  TaskDescription task = Parse(ReplaceFirst(
      ReplaceFirst(
          kTask, "objects: [block]\n",
          "  cameras:\n    front: {position_m: [1, 0, 1], look_at_m: [0, 0, 1], vertical_fov_deg: 50}\n"
          "    side: {position_m: [0, 1, 1], look_at_m: [0, 0, 0], vertical_fov_deg: 60}\n"
          "objects: [block]\ninstruction: push the block\n"),
      "    alias: PushWide",
      "    alias: PushWide\n    instruction: push it far\n    cameras:\n"
      "      front: {position_m: [2, 0, 1], look_at_m: [0, 0, 1], vertical_fov_deg: 40}"));
  EXPECT_EQ(task.instruction, "push the block");
  ASSERT_EQ(task.cameras.size(), 2u);
  EXPECT_EQ(task.cameras[1].name, "side");
  EXPECT_EQ(task.cameras[1].look_at, (std::array<double, 3>{0, 0, 0}));
  TaskDescription base = task;
  base.Apply("base");
  EXPECT_EQ(base.instruction, "push the block");
  EXPECT_EQ(base.cameras.size(), 2u);
  task.Apply("wide");
  EXPECT_EQ(task.instruction, "push it far");
  ASSERT_EQ(task.cameras.size(), 3u);
  EXPECT_EQ(task.cameras[0].vertical_fov, 40) << "the first of a name counts";
  EXPECT_EQ(
      TaskError("objects: [block]\n",
                "  cameras:\n    top: {position_m: [1, 0, 3], look_at_m: [1, 0, 0], vertical_fov_deg: 50}\n"
                "objects: [block]\n"),
      "13: key 'look_at_m': a camera cannot look straight up or down, or at itself");
}

TEST(TaskDescription, FilesMustExist) {
  TempFolder folder;
  const auto file = folder.Write("t.yaml", kTask);
  EXPECT_EQ(ErrorOf([&] { LoadTask(file); }), file.string() + ":4: key 'file': file " +
                                                  folder.path().string() +
                                                  "/newer_robot.yaml does not exist, nor does " +
                                                  (TasksFolder() / "newer_robot.yaml").string());
  EXPECT_EQ(ErrorOf([] { LoadTask("/nowhere/t.yaml"); }),
            "/nowhere/t.yaml: cannot read the task description: No such file or directory");
  EXPECT_EQ(ErrorOf([&] { LoadTask(folder.path()); }),
            folder.path().string() + ": cannot read the task description: a folder, expected a file");
  EXPECT_EQ(ParseTask(kTask, kModelsData / "t.yaml", true).name, "push");
}

TEST(TaskDescription, LiftPotHasTheDocumentedValues) {
  const TaskDescription task = LoadTask(ModelsFolder() / "tasks/lift_pot.yaml");
  EXPECT_EQ(task.instruction, "lift the pot by the handles");
  EXPECT_EQ(task.robot_base.position[0], 0.1);
  ASSERT_EQ(task.parts.size(), 3u);
  EXPECT_EQ(task.parts[2].pose.position, (std::array<double, 3>{0.7, 0, 0.996}));
  EXPECT_TRUE(task.parts[2].free);
  EXPECT_EQ(task.objects, std::vector<std::string>{"pot"});
  ASSERT_EQ(task.variations.size(), 4u);
  EXPECT_EQ(task.variations[0].alias, "LiftPot");
  const auto& both = task.variation("position_and_orientation").randomizations;
  ASSERT_EQ(both.size(), 2u);
  const auto& box = std::get<SpawnBox>(both[0]);
  EXPECT_EQ(box.center, (std::array<double, 2>{0.735, 0}));
  EXPECT_EQ(box.half_extents, (std::array<double, 2>{0.02, 0.15}));
  EXPECT_EQ(box.min_distance, 0.1);
  EXPECT_NEAR(std::get<SpawnYaw>(both[1]).bound, std::acos(-1.0) / 6, 1e-15);
  EXPECT_EQ(task.stages.size(), 4u);
  EXPECT_EQ(task.failure.name, "touching");
  ASSERT_EQ(task.target_distance.size(), 3u);
  EXPECT_EQ(task.target_distance[0].name, "lift_distance");
  EXPECT_EQ(task.pose_error.size(), 1u);
}

TEST(TaskDescription, EveryShippedTaskHasAnInstruction) {
  for (const TaskDescription& task : AllTasks()) EXPECT_NE(task.instruction, "") << task.name;
}

TEST(TaskDescription, OtherRobotsHaveTheirOwnDistances) {
  TaskDescription task = FindTask("stack_two_blocks").task;
  task.ApplyRobot("bimanual_panda", {"left", "right"});
  EXPECT_EQ(task.target_distance.size(), 6u);
  // The entry of `other_robots` is selected by the robot's name or, for an unknown name, by the names of its
  // arms.
  TaskDescription mine = task;
  mine.ApplyRobot("mine", {"arm"});
  EXPECT_EQ(mine.target_distance.size(), 4u);
  task.ApplyRobot("single_panda", {"left"});
  ASSERT_EQ(task.target_distance.size(), 4u);
  EXPECT_EQ(task.target_distance[0].name, "red_cube_to_gripper");
}

TEST(FindTask, ByNameAliasAndFile) {
  const auto expect = [](const std::string& name, const std::string& variation) {
    const TaskSelection selection = FindTask(name);
    EXPECT_EQ(selection.task.name, "lift_pot") << name;
    EXPECT_EQ(selection.variation, variation) << name;
  };
  expect("lift_pot", "base");
  expect("lift_pot/position", "position");
  expect("LiftPot", "base");
  expect("LiftPotPosition", "position");
  expect("LiftPotOrientation", "orientation");
  expect("LiftPotPositionAndOrientation", "position_and_orientation");
  const std::string file = (ModelsFolder() / "tasks/lift_pot.yaml").string();
  expect(file, "base");
  expect(file + "/orientation", "orientation");
}

TEST(FindTask, DistinguishesFilesFromNames) {
  for (const char* file : {"t.yaml", "t.yml", "a/t.yaml/base", "../my.yml/position", ".yaml"}) {
    EXPECT_TRUE(IsTaskFile(file)) << file;
  }
  for (const char* name : {"lift_pot", "lift_pot/position", "LiftPot", "a.yard/base", "t.yamlx", "t.y", ""}) {
    EXPECT_FALSE(IsTaskFile(name)) << name;
  }
}

TEST(FindTask, UnknownNamesGetAHint) {
  EXPECT_EQ(ErrorOf([] { FindTask("lift_pto"); }), "unknown task 'lift_pto'; did you mean 'lift_pot'?");
  EXPECT_EQ(ErrorOf([] { FindTask("LiftPotPositon"); }),
            "unknown task 'LiftPotPositon'; did you mean 'LiftPotPosition'?");
  EXPECT_EQ(ErrorOf([] { FindTask("lift_pot/psition"); }),
            "task lift_pot has no variation 'psition'; did you mean 'position'?");
  EXPECT_EQ(ErrorOf([] { FindTask("somersault"); }).substr(0, 37), "unknown task 'somersault'; there are ");
  EXPECT_EQ(ErrorOf([] { FindTask("/nowhere/t.yaml/base"); }),
            "/nowhere/t.yaml: cannot read the task description: No such file or directory");
}

TEST(FindTask, TheModelsFolderCanBeElsewhere) {
  TempFolder folder;
  setenv("EVALBUS_MODELS", folder.path().c_str(), 1);
  EXPECT_EQ(ModelsFolder(), folder.path());
  EXPECT_EQ(ErrorOf([] { AllTasks(); }),
            "no folder " + folder.path().string() +
                "/tasks; EVALBUS_MODELS must name a folder with tasks/, robots/, props/");
  unsetenv("EVALBUS_MODELS");
  EXPECT_FALSE(AllTasks().empty());
}

}  // namespace evalbus::descriptions_test
