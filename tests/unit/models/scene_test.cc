#include "models/scene.h"

#include <algorithm>
#include <cmath>

#include "base/sha256.h"
#include "models/scene_composer.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::scene_test {

Scene BuildShipped(const std::string& task_name) {
  const TaskDescription task = FindTask(task_name).task;
  return BuildScene(task, LoadRobot(task.robot_file));
}

int IndexOf(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  EXPECT_NE(found, names.end()) << "no '" << name << "'";
  return static_cast<int>(found - names.begin());
}

// Holds the robot at its home position with open hands and weight compensation for a while. It begins
// slightly away from home. Returns the largest distance of an arm joint from home at the end, rad.
double HoldHome(const Scene& scene, const RobotDescription& robot, double seconds) {
  const mjModel* model = scene.physics.get();
  const DataPtr data(mj_makeData(model));
  for (size_t a = 0; a < robot.arms.size(); ++a) {
    const arm_info_t& arm = scene.info.arm[a];
    for (int j = 0; j < arm.num_joints; ++j) {
      data->qpos[arm.joint_qpos_index[j]] = arm.joint_home_rad[j] + 0.05;
      const std::string actuator = arm.name + "/" + robot.arms[a].actuators[j];
      data->ctrl[mj_name2id(model, mjOBJ_ACTUATOR, actuator.c_str())] = arm.joint_home_rad[j];
    }
    const std::string actuator = arm.name + "/hand/" + robot.grippers[a].actuator;
    data->ctrl[mj_name2id(model, mjOBJ_ACTUATOR, actuator.c_str())] = robot.grippers[a].command_open;
  }
  while (data->time < seconds) {
    mj_step1(model, data.get());
    for (const arm_info_t& arm : scene.info.arm) {
      for (const std::string& joint : arm.joint_name) {
        const int dof = model->jnt_dofadr[mj_name2id(model, mjOBJ_JOINT, joint.c_str())];
        data->qfrc_applied[dof] = data->qfrc_bias[dof];
      }
    }
    mj_step2(model, data.get());
  }
  double worst = 0;
  for (const arm_info_t& arm : scene.info.arm) {
    for (int j = 0; j < arm.num_joints; ++j) {
      worst = std::max(worst, std::abs(data->qpos[arm.joint_qpos_index[j]] - arm.joint_home_rad[j]));
    }
  }
  return worst;
}

TEST(Scene, EveryShippedTaskBuilds) {
  for (const TaskDescription& task : AllTasks()) {
    SCOPED_TRACE(task.name);
    const Scene scene = BuildScene(task, LoadRobot(task.robot_file));
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
    EXPECT_EQ(scene.info.timestep_us, 2000);
  }
}

TEST(Scene, LiftPot) {
  const Scene scene = BuildShipped("lift_pot");
  const model_info_t& info = scene.info;
  EXPECT_EQ(info.task, "lift_pot");
  EXPECT_EQ(info.robot, "bimanual_panda");
  EXPECT_EQ(info.time_limit_us, 20000000);
  EXPECT_EQ(info.entity_name,
            (std::vector<std::string>{"world", "left", "right", "left_cabinet", "right_cabinet", "pot"}));
  EXPECT_EQ(info.entity_kind,
            (std::vector<int8_t>{model_info_t::WORLD, model_info_t::ROBOT, model_info_t::ROBOT,
                                 model_info_t::FIXTURE, model_info_t::FIXTURE, model_info_t::OBJECT}));
  // An arm and its hand are one entity.
  EXPECT_EQ(info.body_entity[IndexOf(info.body_name, "left/hand/left_finger")], 1);
  EXPECT_EQ(info.geom_body[IndexOf(info.geom_name, "floor")], 0);
  EXPECT_EQ(info.object_name, std::vector<std::string>{"pot"});
  EXPECT_EQ(info.entity_name[info.object_entity[0]], "pot");
  // The entity's first body is the part's frame.
  EXPECT_EQ(info.body_name[IndexOf(info.body_name, "pot")], "pot");
  EXPECT_EQ(std::find(info.body_entity.begin(), info.body_entity.end(), 5) - info.body_entity.begin(),
            IndexOf(info.body_name, "pot"));

  ASSERT_EQ(info.num_arms, 2);
  EXPECT_EQ(info.arm[1].name, "right");
  EXPECT_EQ(info.arm[1].joint_name[0], "right/joint1");
  EXPECT_EQ(info.arm[1].joint_qpos_index[0], info.joint_qpos_index[IndexOf(info.joint_name, "right/joint1")]);
  EXPECT_EQ(info.arm[0].joint_upper_rad[1], 1.7628);
  EXPECT_EQ(info.arm[0].wrist_site, "left/flange");
  ASSERT_EQ(info.num_grippers, 2);
  EXPECT_EQ(info.gripper[1].arm, 1);
  for (const gripper_info_t& gripper : info.gripper) {
    EXPECT_GE(gripper.num_pad_geoms, 2);
    for (int geom : gripper.pad_geom) {
      EXPECT_NE(info.body_name[info.geom_body[geom]].find("_finger"), std::string::npos)
          << info.geom_name[geom];
    }
  }
  // Every name occurs once.
  for (const auto* names : {&info.body_name, &info.geom_name, &info.joint_name, &info.entity_name}) {
    std::vector<std::string> sorted = *names;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(std::adjacent_find(sorted.begin(), sorted.end()), sorted.end());
    EXPECT_NE(sorted.front(), "");
  }
}

TEST(Scene, LiftPotMatchesRoboEvalsFacts) {
  const Scene scene = BuildShipped("lift_pot");
  const mjModel* model = scene.physics.get();
  const DataPtr data(mj_makeData(model));
  mj_forward(model, data.get());
  const auto expect_at = [&](const double* p, double x, double y, double z) {
    EXPECT_NEAR(p[0], x, 1e-9);
    EXPECT_NEAR(p[1], y, 1e-9);
    EXPECT_NEAR(p[2], z, 1e-9);
  };
  const auto body = [&](const char* name) { return data->xpos + 3 * mj_name2id(model, mjOBJ_BODY, name); };
  expect_at(body("left"), 0.1, 0.3, 0.6);
  expect_at(body("right"), 0.1, -0.3, 0.6);
  expect_at(body("pot"), 0.7, 0, 0.996);
  expect_at(body("pot/pot"), 0.7, 0, 0.996);
  // The counter spans x from 0.5 to 1.1 and y from -0.6 to 0.6. Its top is at 0.859.
  const int counter = mj_name2id(model, mjOBJ_GEOM, "left_cabinet/counter");
  const double* p = data->geom_xpos + 3 * counter;
  const double* size = model->geom_size + 3 * counter;
  EXPECT_NEAR(p[0] - size[1], 0.5, 1e-9);
  EXPECT_NEAR(p[0] + size[1], 1.1, 1e-9);
  EXPECT_NEAR(p[1] + size[0], 0.6, 1e-9);
  EXPECT_NEAR(p[2] + size[2], 0.859, 1e-9);
  // With all joints at 0, the arm is stretched out. The flange is 0.333 + 0.316 + 0.384 - 0.107 above and
  // 0.088 in front of the base.
  expect_at(data->site_xpos + 3 * mj_name2id(model, mjOBJ_SITE, "left/flange"), 0.1 + 0.088, 0.3,
            0.6 + 0.926);
}

TEST(Scene, BothModelsAgree) {
  const Scene scene = BuildShipped("lift_pot");
  const mjModel &physics = *scene.physics, &visual = *scene.visual;
  EXPECT_LT(physics.ngeom, visual.ngeom);
  ASSERT_EQ(physics.nbody, visual.nbody);
  ASSERT_EQ(physics.nq, visual.nq);
  for (int i = 0; i < physics.nbody; ++i) {
    EXPECT_STREQ(mj_id2name(&physics, mjOBJ_BODY, i), mj_id2name(&visual, mjOBJ_BODY, i));
    EXPECT_EQ(physics.body_mass[i], visual.body_mass[i]);
  }
  for (int i = 0; i < physics.njnt; ++i) {
    EXPECT_STREQ(mj_id2name(&physics, mjOBJ_JOINT, i), mj_id2name(&visual, mjOBJ_JOINT, i));
    EXPECT_EQ(physics.jnt_qposadr[i], visual.jnt_qposadr[i]);
  }
  EXPECT_EQ(scene.xml, BuildShipped("lift_pot").xml);
}

TEST(Scene, ArmsHoldHome) {
  for (const char* file : {"robots/bimanual_panda.yaml", "robots/single_panda.yaml"}) {
    const RobotDescription robot = LoadRobot(ModelsFolder() / file);
    const Scene scene = BuildScene(FindTask("lift_pot").task, robot);
    EXPECT_LT(HoldHome(scene, robot, 3), 1e-3) << file;
  }
}

// A scene of test files whose models have the format of newer MuJoCo versions.

constexpr const char* kTask = R"(name: hold
title: Hold still
robot: {file: newer_robot.yaml}
time_limit_s: 1
scene: {base: world.xml, parts: [{name: thing, model: thing.xml, pose: {position_m: [2, 0, 1]}, free: true}]}
objects: []
variations: {base: {}}
stages: []
success: {never: {}}
)";
constexpr const char* kThing = "<mujoco><worldbody><geom size='0.1'/></worldbody></mujoco>";

// Returns the folder of test files after replacing some of them.
struct SceneFiles {
  SceneFiles() {
    std::filesystem::copy(kModelsData, folder.path(), std::filesystem::copy_options::recursive);
    folder.Write("task.yaml", kTask);
    folder.Write("thing.xml", kThing);
  }
  void Change(const std::string& file, const std::string& from, const std::string& to) {
    std::ifstream stream(folder.path() / file);
    const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    folder.Write(file, ReplaceFirst(text, from, to));
  }
  Scene Build() const {
    const TaskDescription task = LoadTask(folder.path() / "task.yaml");
    return BuildScene(task, LoadRobot(task.robot_file));
  }
  std::string Error() const {
    std::string message = ErrorOf([&] { Build(); });
    const std::string prefix = folder.path().string() + "/";
    for (size_t at; (at = message.find(prefix)) != std::string::npos;) message.erase(at, prefix.size());
    return message;
  }
  TempFolder folder;
};

TEST(Scene, RefusesNumbersThatMuJoCoAccepts) {
  for (const auto& [attribute, error] : std::vector<std::pair<std::string, std::string>>{
           {"mass='nan'", "attribute 'mass': expected finite numbers, got 'nan'"},
           {"friction='-1 0 0'", "attribute 'friction': expected finite numbers of at least 0, got '-1'"},
           {"friction='1 NaN 0'", "attribute 'friction': expected finite numbers of at least 0, got 'NaN'"},
           {"density='inf'", "attribute 'density': expected finite numbers, got 'inf'"}}) {
    const SceneFiles files;
    files.folder.Write("thing.xml",
                       "<mujoco><worldbody>\n<geom size='0.1' " + attribute + "/></worldbody></mujoco>");
    EXPECT_EQ(files.Error(), "thing.xml:2: " + error);
  }
}

TEST(Scene, ModelsForNewerVersions) {
  const SceneFiles files;
  const Scene scene = files.Build();
  const RobotDescription robot = LoadRobot(files.folder.path() / "newer_robot.yaml");
  const mjModel* model = scene.physics.get();
  EXPECT_FALSE(scene.warnings.empty());
  const int joint = mj_name2id(model, mjOBJ_JOINT, "right/joint2");
  EXPECT_EQ(model->dof_damping[model->jnt_dofadr[joint]], 5);
  EXPECT_EQ(model->dof_armature[model->jnt_dofadr[joint]], 0.3);
  const int actuator = mj_name2id(model, mjOBJ_ACTUATOR, "right/motor2");
  EXPECT_EQ(model->actuator_gainprm[mjNGAIN * actuator], 350);
  EXPECT_EQ(model->actuator_biasprm[mjNBIAS * actuator + 2], 0);
  const int finger = mj_name2id(model, mjOBJ_JOINT, "left/hand/slide1");
  EXPECT_EQ(model->dof_damping[model->jnt_dofadr[finger]], 20);
  // The geoms of the hand's file have no name, and each finger has two pads.
  const model_info_t& info = scene.info;
  EXPECT_EQ(info.gripper[0].num_pad_geoms, 4);
  EXPECT_EQ(info.geom_name[info.gripper[0].pad_geom[1]], "left/hand/left_finger/geom1");
  // Every warning appears once, although there are two arms.
  std::vector<std::string> warnings = scene.warnings;
  std::sort(warnings.begin(), warnings.end());
  EXPECT_EQ(std::adjacent_find(warnings.begin(), warnings.end()), warnings.end());
  EXPECT_LT(HoldHome(scene, robot, 3), 1e-3);
}

TEST(Scene, AnArmsModelMayContainItsHand) {
  SceneFiles files;
  // A composed document is a valid model file.
  SceneComposer composer(kModelsData / "world.xml");
  composer.Attach(kModelsData / "newer_arm.xml", "a/", Pose{});
  composer.Attach(kModelsData / "newer_hand.xml", "h/", Pose{}, {.parent_body = "a/flange"});
  files.folder.Write("both.xml", composer.ToXml());
  files.folder.Write("newer_robot.yaml", R"(name: whole
arms:
  - name: left
    model: both.xml
    joints: [a/joint1, a/joint2]
    actuators: [a/motor1, a/motor2]
    wrist_site: a/wrist
    home_rad: [0, 0.5]
    gripper:
      joints: [h/slide1, h/slide2]
      joint_open_m: 0.04
      joint_closed_m: 0
      actuator: h/grip
      command_open: 255
      command_closed: 0
      pad_bodies: [h/left_finger, h/right_finger]
)");
  const Scene scene = files.Build();
  EXPECT_EQ(scene.info.arm[0].wrist_site, "left/a/wrist");
  EXPECT_EQ(scene.info.gripper[0].num_pad_geoms, 4);
  EXPECT_EQ(scene.info.entity_name[scene.info.body_entity[IndexOf(scene.info.body_name, "left/h/hand")]],
            "left");
}

TEST(Scene, MistakesNameTheLine) {
  {
    SceneFiles files;
    files.Change("task.yaml", "name: thing", "name: left");
    EXPECT_EQ(files.Error(), "task.yaml:5: part 'left' has the name of an arm of newer_robot");
  }
  {
    SceneFiles files;
    files.Change("newer_robot.yaml", "home_rad: [0.1, 0.5]", "home_rad: [0.1, 3]");
    EXPECT_EQ(
        files.Error(),
        "newer_robot.yaml:3: arm 'left': home position of joint 'joint2' is outside its range [-1.000000, "
        "2.000000] rad");
  }
  {
    SceneFiles files;
    files.Change("newer_robot.yaml", "[motor1, motor2]", "[motor2, motor1]");
    EXPECT_EQ(files.Error(),
              "newer_robot.yaml:3: arm 'left': actuator 'motor2' does not drive joint 'joint1'");
  }
  {
    SceneFiles files;
    files.Change("newer_robot.yaml", "pad_bodies: [left_finger, right_finger]", "pad_bodies: [hand]");
    EXPECT_EQ(files.Error(),
              "newer_robot.yaml:14: gripper of arm 'left': pad body 'hand' has no geom that collides");
  }
  {
    SceneFiles files;
    files.Change("newer_robot.yaml", "joint_open_m: 0.04", "joint_open_m: 40");
    EXPECT_EQ(
        files.Error(),
        "newer_robot.yaml:14: gripper of arm 'left': joint_open of joint 'slide1' is 40 m, expected 0 to "
        "0.04, its range");
  }
  {
    SceneFiles files;
    files.Change("newer_robot.yaml", "joint_open_m: 0.04", "joint_open_rad: 0.04");
    files.Change("newer_robot.yaml", "joint_closed_m", "joint_closed_rad");
    EXPECT_EQ(
        files.Error(),
        "newer_robot.yaml:14: gripper of arm 'left': joint 'slide1' is a slide joint: its positions are "
        "in m");
  }
  {
    SceneFiles files;
    files.folder.Write("thing.xml", "<mujoco>\n<worldbody><geom/></worldbody></mujoco>");
    EXPECT_EQ(files.Error(), "thing.xml:2: MuJoCo: sizes must be positive");
  }
  {
    SceneFiles files;
    files.folder.Write("thing.xml", "<mujoco>\n<worldbody>");
    EXPECT_EQ(files.Error().substr(0, 10), "thing.xml:");
  }
}

TEST(Scene, TheTimestepIsAWholeNumberOfMicroseconds) {
  const auto build = [](const std::string& timestep) {
    SceneFiles files;
    files.folder.Write("world.xml", "<mujoco>\n<option timestep='" + timestep + "'/></mujoco>");
    return files.Error();
  };
  const std::string expected =
      "world.xml:2: <option>: attribute 'timestep': expected a whole number of microseconds from 1 us to 1 "
      "s, got ";
  EXPECT_EQ(build("0.0016666"), expected + "0.0016666 s");
  EXPECT_EQ(build("0.00166666666666667"), expected + "0.00166666666666667 s");
  EXPECT_EQ(build("1e-7"), expected + "1e-07 s");
  EXPECT_EQ(build("0"), expected + "0 s");
  EXPECT_EQ(build("-0.002"), expected + "-0.002 s");
  EXPECT_EQ(build("1e300"), expected + "1e+300 s");
  for (const char* timestep : {"0.001667", "0.002", "2e-3", "1e-6", "0.000333", "0.1"}) {
    EXPECT_EQ(build(timestep), "(no error)") << timestep;
  }
  SceneFiles files;
  files.folder.Write("world.xml", "<mujoco/>");
  EXPECT_EQ(files.Build().info.timestep_us, 2000) << "MuJoCo's default";
}

TEST(Scene, AllTheMassMayBeInVisualGeoms) {
  SceneFiles files;
  files.folder.Write(
      "thing.xml",
      "<mujoco><worldbody><body pos='0 0 0.5'><geom type='box' size='0.1 0.1 0.1' mass='0'/>"
      "<geom type='box' size='0.1 0.1 0.1' pos='0.2 0 0' mass='3' contype='0' conaffinity='0'/>"
      "<body name='door'><joint/><geom type='box' size='0.1 0.1 0.1' mass='0'/>"
      "<geom size='0.1' mass='2' contype='0' conaffinity='0'/></body></body></worldbody></mujoco>");
  const Scene scene = files.Build();
  const mjModel* model = scene.physics.get();
  const int door = mj_name2id(model, mjOBJ_BODY, "thing/door");
  EXPECT_EQ(model->body_mass[door], 2);
  EXPECT_EQ(model->body_mass[door - 1], 3);
  EXPECT_NEAR(model->body_ipos[3 * (door - 1)], 0.2, 1e-15);
  // A body without mass is still refused, and the error names its line.
  SceneFiles none;
  none.folder.Write("thing.xml", "<mujoco><worldbody>\n<geom size='0.1' mass='0'/></worldbody></mujoco>");
  EXPECT_EQ(none.Error().substr(0, 10), "thing.xml:");
}

TEST(Scene, InertiasComeFromVisualGeomsToo) {
  SceneFiles files;
  files.folder.Write("thing.xml",
                     "<mujoco><worldbody><body pos='0 0 0.5'><geom type='box' size='0.1 0.1 0.1'/>"
                     "<geom type='box' size='0.1 0.1 0.1' pos='0.2 0 0' contype='0' conaffinity='0'/>"
                     "</body></worldbody></mujoco>");
  const Scene scene = files.Build();
  const mjModel* model = scene.physics.get();
  // There are two boxes of 8 kg, one of which is only visual.
  const int body = mj_name2id(model, mjOBJ_BODY, "thing") + 1;
  EXPECT_NEAR(model->body_mass[body], 16, 1e-9);
  EXPECT_NEAR(model->body_ipos[3 * body], 0.1, 1e-9);
  EXPECT_EQ(model->body_geomnum[body], 1);
  EXPECT_EQ(model->body_mass[body], scene.visual->body_mass[body]);
}

TEST(Scene, MassOfAMeshIsDensityTimesVolume) {
  SceneFiles files;
  files.folder.Write(
      "thing.xml",
      "<mujoco><asset><mesh name='m' vertex='-1 0 0 1 0 0 0 -1 0 0 1 0 0 0 -1 0 0 1'/></asset>"
      "<worldbody><body name='b'><geom type='mesh' mesh='m' density='3'/></body></worldbody></mujoco>");
  const Scene scene = files.Build();
  const int body = mj_name2id(scene.physics.get(), mjOBJ_BODY, "thing/b");
  ASSERT_GE(body, 0);
  // MuJoCo 2.2 computes an octahedron's volume from a box with the same inertia: 1.31 m^3 instead of 4/3 m^3.
  EXPECT_NEAR(scene.physics->body_mass[body], 4, 1e-6);
  EXPECT_NEAR(scene.physics->body_inertia[3 * body], 4 / 5.0, 1e-6);
}

TEST(Scene, ErrorsInsideMuJoCoAreCaught) {
  // With this input, MuJoCo itself would wait for a key.
  SceneFiles files;
  files.Change("world.xml", "<option", "<size nstack='1'/><option");
  EXPECT_EQ(files.Error(), "scene: MuJoCo: engine error: Stack overflow");
}

TEST(Sha256File, KnownDigest) {
  TempFolder folder;
  // FIPS 180-2, appendix B.1.
  EXPECT_EQ(Sha256File(folder.Write("abc", "abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256File(folder.Write("empty", "")),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(ErrorOf([] { Sha256File("/nowhere"); }), "/nowhere: cannot be read: No such file or directory");
  EXPECT_EQ(ErrorOf([&] { Sha256File(folder.path()); }),
            folder.path().string() + ": cannot be read: a folder, expected a file");
}

TEST(Scene, ATasksCameraHasItsDescribedView) {
  TaskDescription task = FindTask("lift_pot").task;
  const RobotDescription robot = LoadRobot(task.robot_file);
  const Scene before = BuildScene(task, robot);
  task.cameras = {{"front", {2, 1, 3}, {0.5, 0, 1}, 40},
                  {"side", {0.5, 3, 1}, {0.5, 0, 1}, 50},
                  {"front", {9, 9, 9}, {0, 0, 0}, 10}};
  const Scene scene = BuildScene(task, robot);
  const mjModel& visual = *scene.visual;
  EXPECT_EQ(visual.ncam, before.visual->ncam + 1) << "front is moved, side is new";
  const DataPtr data(mj_makeData(&visual));
  mj_kinematics(&visual, data.get());
  mj_comPos(&visual, data.get());
  mj_camlight(&visual, data.get());
  const int front = mj_name2id(&visual, mjOBJ_CAMERA, "front");
  EXPECT_EQ(visual.cam_fovy[front], 40);
  const mjtNum* axes = data->cam_xmat + 9 * front;
  // The camera looks along -z, so the expected vector is (0.5, 0, 1) - (2, 1, 3), of length sqrt(1.5^2 + 1 +
  // 4).
  const double length = std::sqrt(7.25);
  EXPECT_NEAR(-axes[2], -1.5 / length, 1e-9);
  EXPECT_NEAR(-axes[5], -1 / length, 1e-9);
  EXPECT_NEAR(-axes[8], -2 / length, 1e-9);
  EXPECT_NEAR(axes[6], 0, 1e-9) << "its x axis is level";
  EXPECT_GT(axes[7], 0) << "its y axis points up";
  EXPECT_EQ(data->cam_xpos[3 * front + 2], 3);
}

}  // namespace evalbus::scene_test
