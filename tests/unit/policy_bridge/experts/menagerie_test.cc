// Tests external robots from MuJoCo Menagerie, robosuite and gym-aloha, if environment variables name the
// folders with their models (scripts/interop sets them).
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "base/errors.h"
#include "tests/unit/policy_bridge/expert_play.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::policy::menagerie_test {

namespace fs = std::filesystem;

// Sets `folder` to the folder that the environment variable names. Skips the test if a file is missing there.
#define MODELS_WITH(variable, folder, ...)                                                       \
  const char* const named = std::getenv(variable);                                               \
  if (!named) GTEST_SKIP() << variable " names no folder with models";                           \
  const fs::path folder = named;                                                                 \
  for (const char* file : {__VA_ARGS__}) {                                                       \
    if (!fs::exists(folder / file)) GTEST_SKIP() << (folder / file).string() << " is not there"; \
  }
#define MENAGERIE_WITH(folder, ...) MODELS_WITH("EVALBUS_MENAGERIE", folder, __VA_ARGS__)

TEST(Menagerie, TwoPandasLiftThePot) {
  MENAGERIE_WITH(folder, "franka_emika_panda/panda_nohand.xml", "franka_emika_panda/hand.xml");
  ExpertStage stage("lift_pot/position", "bimanual_panda_menagerie", {.model_path = {folder}});
  int successes = 0;
  for (int64_t seed = 0; seed < 20; ++seed) {
    successes += stage.Play(seed).verdict == metrics::Verdict::kSuccess;
  }
  EXPECT_GE(successes, 19);
}

// An arm of Menagerie without a hand, to which the Panda's hand is attached.
struct Bare {
  std::string file;
  // Names of the joints and, if they differ, of the actuators.
  std::string joints, actuators;
  std::string home, site, body;
};

// Composes the arm in an empty scene, holds it at home for a second and returns its largest distance from
// home, rad.
double HoldHome(const RobotDescription& robot) {
  TaskDescription task = FindTask("stack_two_blocks").task;
  task.parts.clear();
  task.objects.clear();
  Scene scene = BuildScene(task, robot);
  scene.info.substeps = 10;
  sim::World world(scene.physics.get(), scene.info, robot, task, 10);
  Variation nothing;
  world.Reset(0, nothing);
  action_t action{};
  action.mode = action_t::JOINT_POSITION;
  action.joint_position_rad = robot.arms[0].home;
  action.gripper_closing = {0};
  EXPECT_EQ(world.Apply(action), "");
  state_t state{};
  double farthest = 0;
  for (int tick = 0; tick < 50; ++tick) {
    EXPECT_TRUE(world.Step()) << world.instability();
    world.Fill(&state);
    for (size_t j = 0; j < robot.arms[0].home.size(); ++j) {
      farthest = std::max(farthest, std::abs(state.arm[0].joint_position_rad[j] - robot.arms[0].home[j]));
    }
  }
  return farthest;
}

void ExpectItHoldsHome(const fs::path& folder, const Bare& arm, const std::string& more = "") {
  TemporaryFolder here;
  const fs::path file = here.path() / "robot.yaml";
  std::ofstream(file) << "name: robot\narms:\n  - name: arm\n    model: " << arm.file
                      << "\n    base: {position_m: [0, 0, 0.6]}\n    joints: [" << arm.joints
                      << "]\n    actuators: [" << arm.actuators << "]\n    wrist_site: " << arm.site
                      << "\n    home_rad: [" << arm.home << "]\n"
                      << more << "    gripper:\n      model: panda/hand.xml\n      attach_body: " << arm.body
                      << "\n      joints: [finger_joint1, finger_joint2]\n      joint_open_m: 0.04\n"
                      << "      joint_closed_m: 0\n      actuator: gripper\n      command_open: 0.04\n"
                      << "      command_closed: 0\n      pad_bodies: [left_finger, right_finger]\n";
  EXPECT_LT(HoldHome(LoadRobot(file, {.model_path = {folder}})), 0.02);
}

constexpr char kSevenDampings[] = "    joint_damping_Nms_per_rad: [60, 60, 45, 45, 10, 10, 10]\n";
constexpr char kSevenGains[] = "    position_gain_Nm_per_rad: [4500, 4500, 3500, 3500, 2000, 2000, 2000]\n";

TEST(Menagerie, Fr3) {
  MENAGERIE_WITH(folder, "franka_fr3/fr3.xml");
  const std::string names =
      "fr3_joint1, fr3_joint2, fr3_joint3, fr3_joint4, fr3_joint5, fr3_joint6, fr3_joint7";
  ExpectItHoldsHome(
      folder,
      {"franka_fr3/fr3.xml", names, names, "0, 0, 0, -1.57, 0, 1.57, -0.785", "attachment_site", "fr3_link7"},
      std::string(kSevenGains) + kSevenDampings);
}

TEST(Menagerie, Gen3) {
  MENAGERIE_WITH(folder, "kinova_gen3/gen3.xml");
  const std::string names = "joint_1, joint_2, joint_3, joint_4, joint_5, joint_6, joint_7";
  ExpectItHoldsHome(folder,
                    {"kinova_gen3/gen3.xml", names, names, "0, 0.262, 3.142, -2.269, 0, 0.96, 1.571",
                     "pinch_site", "bracelet_link"},
                    "    position_gain_Nm_per_rad: [2000, 2000, 2000, 2000, 500, 500, 500]\n"
                    "    joint_damping_Nms_per_rad: [50, 50, 40, 40, 10, 10, 10]\n");
}

TEST(Menagerie, Ur5e) {
  MENAGERIE_WITH(folder, "universal_robots_ur5e/ur5e.xml");
  std::ifstream stream(folder / "universal_robots_ur5e/ur5e.xml");
  const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  // Menagerie's original and the copy on PyPI have different names.
  const bool is_menagerie = text.find("shoulder_pan_joint") != std::string::npos;
  const std::string joints = is_menagerie
                                 ? "shoulder_pan_joint, shoulder_lift_joint, elbow_joint, wrist_1_joint, "
                                   "wrist_2_joint, wrist_3_joint"
                                 : "shoulder_pan, shoulder_lift, elbow, wrist_1, wrist_2, wrist_3";
  const std::string actuators = "shoulder_pan, shoulder_lift, elbow, wrist_1, wrist_2, wrist_3";
  ExpectItHoldsHome(folder,
                    {"universal_robots_ur5e/ur5e.xml", joints, actuators,
                     "0, -1.571, 1.571, -1.571, -1.571, 0", "attachment_site", "wrist_3_link"},
                    "    position_gain_Nm_per_rad: [2000, 2000, 2000, 500, 500, 500]\n"
                    "    joint_damping_Nms_per_rad: [60, 60, 45, 10, 10, 10]\n");
}

// The file of this arm contains a hand.
TEST(Menagerie, XArm7) {
  MENAGERIE_WITH(folder, "ufactory_xarm7/xarm7.xml");
  TemporaryFolder here;
  const fs::path file = here.path() / "robot.yaml";
  std::ofstream(file) << R"(name: xarm7
arms:
  - name: arm
    model: ufactory_xarm7/xarm7.xml
    base: {position_m: [0, 0, 0.6]}
    joints: [joint1, joint2, joint3, joint4, joint5, joint6, joint7]
    actuators: [act1, act2, act3, act4, act5, act6, act7]
    wrist_site: link_tcp
    home_rad: [0, -0.247, 0, 0.909, 0, 1.15644, 0]
    position_gain_Nm_per_rad: [1500, 1500, 1000, 1000, 1000, 800, 800]
    joint_damping_Nms_per_rad: [60, 60, 45, 45, 10, 10, 10]
    gripper:
      joints: [left_driver_joint, right_driver_joint]
      joint_open_rad: 0
      joint_closed_rad: 0.85
      actuator: gripper
      command_open: 0
      command_closed: 255
      pad_bodies: [left_finger, right_finger]
)";
  EXPECT_LT(HoldHome(LoadRobot(file, {.model_path = {folder}})), 0.02);
}

// The robot is one of the two arms in its file. The other arm hangs down.
TEST(Menagerie, Aloha) {
  MENAGERIE_WITH(folder, "aloha/aloha.xml");
  TemporaryFolder here;
  const fs::path file = here.path() / "robot.yaml";
  std::ofstream(file) << R"(name: aloha
arms:
  - name: arm
    model: aloha/aloha.xml
    joints: [left/waist, left/shoulder, left/elbow, left/forearm_roll, left/wrist_angle, left/wrist_rotate]
    actuators: [left/waist, left/shoulder, left/elbow, left/forearm_roll, left/wrist_angle, left/wrist_rotate]
    wrist_site: left/gripper
    home_rad: [0, -0.96, 1.16, 0, -0.3, 0]
    gripper:
      joints: [left/left_finger]
      joint_open_m: 0.037
      joint_closed_m: 0.002
      actuator: left/gripper
      command_open: 0.037
      command_closed: 0.002
      pad_bodies: [left/left_finger_link, left/right_finger_link]
)";
  EXPECT_LT(HoldHome(LoadRobot(file, {.model_path = {folder}})), 0.1);
}

// A copy of an external folder, in which a test changes files, for example elements that evalbus refuses.
class Copy {
 public:
  Copy(const fs::path& from, const std::string& name) {
    fs::copy(from, folder_.path() / name, fs::copy_options::recursive);
  }
  const fs::path& path() const { return folder_.path(); }
  void Replace(const std::string& file, const std::string& what, const std::string& by) const {
    std::ifstream stream(path() / file);
    std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    ASSERT_NE(text.find(what), std::string::npos) << file << " has no " << what;
    text.replace(text.find(what), what.size(), by);
    std::ofstream(path() / file) << text;
  }

 private:
  TemporaryFolder folder_;
};

// Motors drive robosuite's arms, and the gains turn them into servos.
TEST(Robosuite, XArm7) {
  MODELS_WITH("EVALBUS_ROBOSUITE", folder, "robots/xarm7/robot.xml");
  ExpectItHoldsHome(folder,
                    {"robots/xarm7/robot.xml", "joint1, joint2, joint3, joint4, joint5, joint6, joint7",
                     "torq_j1, torq_j2, torq_j3, torq_j4, torq_j5, torq_j6, torq_j7",
                     "0, -0.247, 0, 0.909, 0, 1.15644, 0", "ee", "right_hand"},
                    "    position_gain_Nm_per_rad: [1500, 1500, 1000, 1000, 1000, 800, 800]\n" +
                        std::string(kSevenDampings));
}

// The wrist of this arm has no site.
TEST(Robosuite, Gen3) {
  MODELS_WITH("EVALBUS_ROBOSUITE", folder, "robots/kinova3/robot.xml");
  const Copy copy(folder / "robots/kinova3", "kinova3");
  const std::string hand = R"(<body name="right_hand" pos="0 0 -0.0615" quat="0 0.707105 -0.707108 0">)";
  copy.Replace("kinova3/robot.xml", hand, hand + R"(<site name="wrist"/>)");
  ExpectItHoldsHome(
      copy.path(),
      {"kinova3/robot.xml", "Actuator1, Actuator2, Actuator3, Actuator4, Actuator5, Actuator6, Actuator7",
       "torq_j1, torq_j2, torq_j3, torq_j4, torq_j5, torq_j6, torq_j7",
       "0, 0.262, 3.142, -2.269, 0, 0.96, 1.571", "wrist", "right_hand"},
      "    position_gain_Nm_per_rad: [2000, 2000, 2000, 2000, 500, 500, 500]\n"
      "    joint_damping_Nms_per_rad: [50, 50, 40, 40, 10, 10, 10]\n");
}

// The files contain both arms and one actuator per finger. This test uses one arm, with fingers coupled as in
// Menagerie. All moving bodies have explicit inertias.
TEST(GymAloha, ViperX) {
  MODELS_WITH("EVALBUS_GYM_ALOHA", folder, "vx300s_dependencies.xml", "vx300s_left.xml");
  const Copy here(folder, "aloha");
  here.Replace("aloha/vx300s_dependencies.xml", R"( inertiagrouprange="4 5")", "");
  std::ofstream(here.path() / "aloha/arm.xml") << R"(<mujoco>
  <include file="vx300s_dependencies.xml"/>
  <worldbody><include file="vx300s_left.xml"/></worldbody>
  <equality>
    <joint joint1="vx300s_left/left_finger" joint2="vx300s_left/right_finger" polycoef="0 -1 0 0 0"/>
  </equality>
  <actuator>
    <position name="waist" joint="vx300s_left/waist" kp="800"/>
    <position name="shoulder" joint="vx300s_left/shoulder" kp="1600"/>
    <position name="elbow" joint="vx300s_left/elbow" kp="800"/>
    <position name="forearm_roll" joint="vx300s_left/forearm_roll" kp="10"/>
    <position name="wrist_angle" joint="vx300s_left/wrist_angle" kp="50"/>
    <position name="wrist_rotate" joint="vx300s_left/wrist_rotate" kp="20"/>
    <position name="fingers" joint="vx300s_left/left_finger" kp="200"/>
  </actuator>
</mujoco>)";
  const fs::path file = here.path() / "robot.yaml";
  std::ofstream(file) << R"(name: viperx
arms:
  - name: arm
    model: aloha/arm.xml
    base: {position_m: [0, 0, 0.6]}
    joints: [vx300s_left/waist, vx300s_left/shoulder, vx300s_left/elbow, vx300s_left/forearm_roll,
             vx300s_left/wrist_angle, vx300s_left/wrist_rotate]
    actuators: [waist, shoulder, elbow, forearm_roll, wrist_angle, wrist_rotate]
    wrist_site: cali_left_site1
    home_rad: [0, -0.96, 1.16, 0, -0.3, 0]
    gripper:
      joints: [vx300s_left/left_finger, vx300s_left/right_finger]
      joint_open_m: 0.057
      joint_closed_m: 0.021
      actuator: fingers
      command_open: 0.057
      command_closed: 0.021
      pad_bodies: [vx300s_left/left_finger_link, vx300s_left/right_finger_link]
)";
  EXPECT_LT(HoldHome(LoadRobot(file, {.model_path = {folder}})), 0.02);
}

}  // namespace evalbus::policy::menagerie_test
