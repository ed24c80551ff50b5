// Tests what a robot description adds to its models, and the warnings about it.
#include <cmath>

#include "models/compile_model.h"
#include "models/scene.h"
#include "models/vibration.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::robot_parts_test {

// The robot has one hinge with inertia 0.1 kg m^2, a servo with a velocity gain, and a massless finger.
constexpr const char* kArm = R"(<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <worldbody>
    <body name="base">
      <geom size="0.05"/>
      <body name="link" pos="0 0 0.2">
        <inertial mass="1" pos="0 0 0" diaginertia="0.1 0.1 0.1"/>
        <joint name="j" axis="0 0 1" range="-1 1" damping="DAMPING"/>
        <geom size="0.05"/>
        <site name="wrist"/>
        <body name="finger" pos="0 0 0.1">
          <inertial mass="1e-9" pos="0 0 0" diaginertia="1e-12 1e-12 1e-12"/>
          <joint name="f" type="slide" range="0 0.1"/>
          <geom size="0.01"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="servo" joint="j" kp="10" kv="KV"/>
    <position name="grip" joint="f" kp="10"/>
  </actuator>
</mujoco>)";

constexpr const char* kPostRobot = R"(name: post
arms:
  - name: left
    model: arm.xml
    joints: [j]
    actuators: [servo]
    wrist_site: wrist
    home_rad: [0]
    stand: {model: stand.xml, pose: {position_m: [0, 0, -0.5]}}
    excludes: [[base, finger]]
    cameras: [{name: eye, body: link, pose: {position_m: [0, 0, 0.3]}, vertical_fov_deg: 60}]
    gripper:
      joints: [f]
      joint_open_m: 0.1
      joint_closed_m: 0
      position_gain_N_per_m: 500
      actuator: grip
      command_open: 0.1
      command_closed: 0
      pad_bodies: [finger]
)";

struct RobotFiles {
  explicit RobotFiles(const std::string& damping = "0", const std::string& kv = "0",
                      const std::string& robot = kPostRobot) {
    folder.Write("arm.xml", ReplaceFirst(ReplaceFirst(kArm, "DAMPING", damping), "KV", kv));
    folder.Write("stand.xml", "<mujoco><worldbody><geom name='column' size='0.1'/></worldbody></mujoco>");
    file = folder.Write("robot.yaml", robot);
  }
  Scene Build() const {
    TaskDescription task;
    task.scene_file = kModelsData / "world.xml";
    return BuildScene(task, LoadRobot(file));
  }
  TempFolder folder;
  std::filesystem::path file;
};

TEST(RobotParts, ArmsNeedPositionServos) {
  RobotFiles files;
  files.folder.Write("arm.xml", ReplaceFirst(ReplaceFirst(kArm, "DAMPING", "0"),
                                             R"(<position name="servo" joint="j" kp="10" kv="KV"/>)",
                                             R"(<motor name="servo" joint="j"/>)"));
  const std::string error = ErrorOf([&] { files.Build(); });
  EXPECT_TRUE(
      error.ends_with("arm 'left': actuator 'servo' is not a position servo, so it would use positions as "
                      "torques or speeds; give position_gain_Nm_per_rad"))
      << error;
}

TEST(RobotParts, StandCameraExcludeAndGripperGain) {
  const Scene scene = RobotFiles().Build();
  const mjModel* model = scene.physics.get();
  const auto id = [&](mjtObj type, const char* name) { return mj_name2id(model, type, name); };
  const int stand = id(mjOBJ_BODY, "left/stand");
  ASSERT_GE(stand, 0);
  EXPECT_EQ(model->body_parentid[stand], id(mjOBJ_BODY, "left"));
  EXPECT_EQ(model->body_pos[3 * stand + 2], -0.5);
  // The stand belongs to the arm's entity.
  EXPECT_EQ(scene.info.body_entity[stand], scene.info.arm[0].entity);
  const int camera = id(mjOBJ_CAMERA, "left/eye");
  ASSERT_GE(camera, 0);
  EXPECT_EQ(model->cam_bodyid[camera], id(mjOBJ_BODY, "left/link"));
  EXPECT_EQ(model->cam_fovy[camera], 60);
  ASSERT_EQ(model->nexclude, 1);
  const int base = id(mjOBJ_BODY, "left/base"), finger = id(mjOBJ_BODY, "left/finger");
  EXPECT_EQ(model->exclude_signature[0], ((base + 1) << 16) + finger + 1);
  EXPECT_EQ(model->actuator_gainprm[mjNGAIN * id(mjOBJ_ACTUATOR, "left/grip")], 500);
}

constexpr const char* kRobotCameras = R"(cameras:
  - {name: maker/head, pose: {position_m: [0, 0, 1]}, vertical_fov_deg: 30}
  - {name: maker/wrist, body: left/link, pose: {position_m: [0, 0, 0.5]}}
)";

TEST(RobotParts, CamerasOfTheRobotHaveTheirOwnNames) {
  const RobotFiles files("0", "0", std::string(kPostRobot) + kRobotCameras);
  TaskDescription task;
  task.scene_file = kModelsData / "world.xml";
  task.robot_base = {.position = {5, 0, 2}, .quaternion = {0, 0, 0, 1}};
  const Scene scene = BuildScene(task, LoadRobot(files.file));
  const mjModel& model = *scene.physics;
  const int head = mj_name2id(&model, mjOBJ_CAMERA, "maker/head");
  const int wrist = mj_name2id(&model, mjOBJ_CAMERA, "maker/wrist");
  ASSERT_GE(head, 0);
  ASSERT_GE(wrist, 0);
  // One camera is at the robot's position and orientation, and another is on one of its bodies.
  EXPECT_EQ(model.cam_bodyid[head], 0);
  EXPECT_EQ(model.cam_pos[3 * head], 5);
  EXPECT_EQ(model.cam_pos[3 * head + 2], 3);
  EXPECT_EQ(model.cam_quat[4 * head + 3], 1);
  EXPECT_EQ(model.cam_fovy[head], 30);
  EXPECT_EQ(model.cam_bodyid[wrist], mj_name2id(&model, mjOBJ_BODY, "left/link"));
  EXPECT_EQ(model.cam_fovy[wrist], 45);
}

TEST(RobotParts, MistakesNameTheLine) {
  const auto error = [](const std::string& from, const std::string& to) {
    const RobotFiles files("0", "0", ReplaceFirst(kPostRobot, from, to));
    const std::string message = ErrorOf([&] { files.Build(); });
    return message.substr(message.find("robot.yaml:") + 11);
  };
  EXPECT_EQ(error("[base, finger]", "[base, fingr]"),
            "10: key 'excludes[0][1]': arm.xml has no body 'fingr'; did you mean 'finger'?");
  EXPECT_EQ(error("[base, finger]", "[base]"),
            "10: key 'excludes[0]': expected the names of two bodies, got 1");
  EXPECT_EQ(error("body: link", "body: hand"),
            "11: key 'body': arm.xml has no body 'hand'; expected one of base, finger, link");
  EXPECT_EQ(error("vertical_fov_deg: 60", "vertical_fov_deg: 0"),
            "11: key 'vertical_fov_deg': expected a number in [1, 170], got '0'");
  const auto camera_error = [&](const std::string& from, const std::string& to) {
    return error("      pad_bodies: [finger]\n",
                 "      pad_bodies: [finger]\n" + ReplaceFirst(kRobotCameras, from, to));
  };
  EXPECT_EQ(camera_error("left/link", "left/lnk"),
            "23: key 'body': robot.yaml has no body 'left/lnk'; did you mean 'left/link'?");
  EXPECT_EQ(camera_error("maker/wrist", "maker/head"),
            "23: key 'name': another camera has the name 'maker/head'");
  EXPECT_EQ(camera_error("maker/head", "my head"),
            "22: key 'name': expected a name that begins with a letter and contains only letters, digits, "
            "'_' and '/', got 'my head'");
  EXPECT_EQ(error("      position_gain_N_per_m: 500\n",
                  "      position_gain_N_per_m: 500\n      position_gain_Nm_per_rad: 1\n"),
            "17: key 'position_gain_Nm_per_rad': give either this or 'position_gain_N_per_m'");
}

// Returns the arm's velocity after one step without a command. The velocity begins at 1 rad/s.
double AfterOneStep(const mjModel& model) {
  const DataPtr data(mj_makeData(&model));
  data->qvel[0] = 1;
  mj_step(&model, data.get());
  return data->qvel[0];
}

// With an inertia of 0.1 kg m^2 and steps of 2 ms, a velocity gain of 50 N m s/rad stops the joint in one
// step, whatever the joint's own damping. A higher gain reverses the joint.
TEST(Vibration, IsWarnedOfWhereAStepTurnsTheVelocityRound) {
  for (const char* damping : {"0", "5"}) {
    for (const int kv : {0, 49, 51, 500}) {
      SCOPED_TRACE(std::string(damping) + " " + std::to_string(kv));
      const RobotFiles files(damping, std::to_string(kv));
      const Scene scene = files.Build();
      EXPECT_EQ(FindVibration(LoadRobot(files.file), scene.info, *scene.physics).size(), kv > 50 ? 1 : 0);
      EXPECT_EQ(AfterOneStep(*scene.physics) < 0, kv > 50);
    }
  }
  const RobotFiles files("0", "100");
  EXPECT_EQ(files.Build().warnings.back(),
            files.file.string() +
                ":3: actuator 'servo' of arm 'left' will vibrate: steps of 2 ms allow a velocity "
                "gain of 50, it has 100; give position_gain_Nm_per_rad and "
                "joint_damping_Nms_per_rad");
}

TEST(RobotParts, AJointWithoutLimitsMayTurn) {
  RobotFiles files;
  files.folder.Write(
      "arm.xml",
      ReplaceFirst(ReplaceFirst(ReplaceFirst(kArm, " range=\"-1 1\"", ""), "DAMPING", "0"), "KV", "0"));
  const arm_info_t arm = files.Build().info.arm[0];
  EXPECT_LT(arm.joint_lower_rad[0], -6.28);
  EXPECT_GT(arm.joint_upper_rad[0], 6.28);
}

TEST(ReadPose, PublishesTheUnitQuaternion) {
  const RobotFiles files("0", "0",
                         ReplaceFirst(kPostRobot, "position_m: [0, 0, -0.5]",
                                      "position_m: [0, 0, -0.5], quaternion_wxyz: [-1, 1, 0, 0]"));
  const std::string message = ErrorOf([&] { LoadRobot(files.file); });
  EXPECT_EQ(message.substr(message.find("expected")),
            "expected a unit quaternion, got norm 1.41421; of norm 1 it is [-0.707107, 0.707107, 0, 0]");
}

// A copy of a shipped task in another folder still finds the parts.
TEST(TaskFile, ACopyFindsItsPartsInTheInstalledModels) {
  TempFolder folder;
  const std::filesystem::path copy = folder.path() / "my_task.yaml";
  std::filesystem::copy_file(TasksFolder() / "lift_pot.yaml", copy);
  const TaskDescription task = LoadTask(copy);
  EXPECT_EQ(task.file, copy);
  EXPECT_TRUE(std::filesystem::equivalent(task.robot_file, ModelsFolder() / "robots/bimanual_panda.yaml"));
  // Files next to the copy take precedence.
  const auto own = folder.Write("tasks/my_task.yaml", task.text);
  folder.Write("props/pot/pot.xml", "<mujoco/>");
  EXPECT_EQ(LoadTask(own).parts[2].model_file, folder.path() / "props/pot/pot.xml");
  EXPECT_NE(LoadTask(own).parts[1].model_file, folder.path() / "props/base_cabinet/base_cabinet.xml");
  const std::string text = ReplaceFirst(task.text, "pot/pot.xml", "pot/pit.xml");
  const std::string message = ErrorOf([&] { LoadTask(folder.Write("tasks/bad.yaml", text)); });
  EXPECT_EQ(message.substr(message.find("file /")),
            "file " + (folder.path() / "props/pot/pit.xml").string() + " does not exist, nor does " +
                (ModelsFolder() / "props/pot/pit.xml").lexically_normal().string());
}

}  // namespace evalbus::robot_parts_test
