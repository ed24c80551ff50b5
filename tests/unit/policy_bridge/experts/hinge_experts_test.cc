// Tests RotateValve and PackBox in the simulated world, with their experts and their hinged parts.
#include <fstream>
#include <sstream>

#include "base/errors.h"
#include "policy_bridge/planning/robot.h"
#include "tests/unit/policy_bridge/expert_play.h"

namespace evalbus::policy::hinge_experts_test {

TEST(RotateValveExpert, SucceedsOnEachVariation) {
  for (const std::string variation : {"base", "position", "position_and_orientation", "obstacle"}) {
    ExpertStage stage("rotate_valve/" + variation);
    for (const int64_t seed : {3, 4}) stage.ExpectSuccess(seed);
  }
}

TEST(PackBoxExpert, SucceedsOnEachVariation) {
  for (const std::string variation : {"base", "position", "orientation", "position_and_orientation"}) {
    ExpertStage stage("pack_box/" + variation);
    for (const int64_t seed : {3, 4}) stage.ExpectSuccess(seed);
  }
}

TEST(HingeExperts, WorkAtAnyControlRate) {
  for (const std::string task : {"rotate_valve/position_and_orientation", "pack_box/base"}) {
    ExpertStage stage(task);
    stage.ExpectSuccess(5, 20);
    stage.ExpectSuccess(5, 500);
  }
}

TEST(HingeExperts, EqualSeedsGiveEqualActionsWhateverCameBefore) {
  for (const std::string task : {"rotate_valve/position", "pack_box/orientation"}) {
    ExpertStage stage(task);
    const auto first = stage.Play(6).actions;
    EXPECT_NE(first, stage.Play(7).actions);
    EXPECT_EQ(first, stage.Play(6).actions);
    EXPECT_EQ(first, ExpertStage(task).Play(6).actions);
  }
}

TEST(HingeExperts, OneArmIsTooFew) {
  for (const std::string name : {"rotate_valve", "pack_box"}) {
    const Scene scene = BuildScene(FindTask(name).task, LoadRobot(FindRobot("single_panda")));
    try {
      MakePolicy("expert", *scene.physics, scene.info);
      FAIL();
    } catch (const InputError& error) {
      EXPECT_EQ(error.what(), "policy \"expert\": " + name + " requires a robot with two arms");
    }
  }
}

// Returns the angle of a body's hinge 10 s after it was at `start`, with the robot at home.
double AngleAtRest(const Scene& scene, const std::string& joint, double start) {
  const mjModel& model = *scene.physics;
  const DataPtr data(mj_makeData(&model));
  for (const arm_info_t& arm : scene.info.arm) {
    for (int j = 0; j < arm.num_joints; ++j) {
      data->qpos[arm.joint_qpos_index[j]] = arm.joint_home_rad[j];
      for (int actuator = 0; actuator < model.nu; ++actuator) {
        const int driven = model.actuator_trnid[2 * actuator];
        if (model.actuator_trntype[actuator] == mjTRN_JOINT &&
            model.jnt_qposadr[driven] == arm.joint_qpos_index[j]) {
          data->ctrl[actuator] = arm.joint_home_rad[j];
        }
      }
    }
  }
  const int qpos = model.jnt_qposadr[mj_name2id(&model, mjOBJ_JOINT, joint.c_str())];
  data->qpos[qpos] = start;
  for (int step = 0; step < 5000; ++step) mj_step(&model, data.get());
  return data->qpos[qpos];
}

TEST(CardboardBox, FlapsStayOpenAndClosed) {
  const TaskDescription task = FindTask("pack_box").task;
  const Scene scene = BuildScene(task, LoadRobot(task.robot_file));
  EXPECT_NEAR(AngleAtRest(scene, "box/left_flap", 0.698), 0.698, 1e-3);
  EXPECT_NEAR(AngleAtRest(scene, "box/right_flap", 0.5236), 0.5236, 1e-3);
  EXPECT_NEAR(AngleAtRest(scene, "box/left_flap", -2.0944), -2.0944, 1e-3);
  EXPECT_NEAR(AngleAtRest(scene, "box/right_flap", -2.2689), -2.2689, 1e-3);
  // A flap that is released 0.1 rad before its end sinks to the end. 1.13 kg at 0.12 m against 10 N m s/rad
  // give 0.13 rad/s.
  EXPECT_NEAR(AngleAtRest(scene, "box/left_flap", -1.994), -2.0944, 1e-3);
}

TEST(Valve, WheelStaysWhereItIsLeft) {
  const TaskDescription task = FindTask("rotate_valve").task;
  const Scene scene = BuildScene(task, LoadRobot(task.robot_file));
  EXPECT_NEAR(AngleAtRest(scene, "first_valve/wheel", 0), 0, 1e-3);
  EXPECT_NEAR(AngleAtRest(scene, "second_valve/wheel", 2), 2, 1e-3);
}

// A rectangle on the table, seen from above.
struct Footprint {
  Eigen::Isometry3d pose;
  double half_x, half_y;
};

// Returns whether a point of a is well inside b.
bool Reaches(const Footprint& a, const Footprint& b) {
  constexpr double kMargin = 0.002;
  for (double u = -1; u <= 1; u += 0.05) {
    for (double v = -1; v <= 1; v += 0.05) {
      const Eigen::Vector3d point =
          b.pose.inverse() * a.pose * Eigen::Vector3d(u * a.half_x, v * a.half_y, 0);
      if (std::abs(point.x()) < b.half_x - kMargin && std::abs(point.y()) < b.half_y - kMargin) return true;
    }
  }
  return false;
}

TEST(RotateValve, NothingOverlapsAtTheStart) {
  const TaskSelection selection = FindTask("RotateValveObstacle");
  const RobotDescription robot = LoadRobot(selection.task.robot_file);
  const Scene scene = BuildScene(selection.task, robot);
  sim::World world(scene.physics.get(), scene.info, robot, selection.task, 10);
  state_t state{};
  for (int64_t seed = 0; seed < 200; ++seed) {
    world.Reset(seed, selection.task.variation(selection.variation));
    world.Fill(&state);
    const auto pose = [&](const std::string& body) { return BodyPose(state, BodyId(*scene.physics, body)); };
    const Eigen::Translation3d pipe(0.054, 0, 0);
    const Footprint first{pose("first_valve/valve") * pipe, 0.199, 0.046};
    const Footprint second{pose("second_valve/valve") * pipe, 0.199, 0.046};
    const Footprint board{pose("obstacle"), 0.015, 0.06};
    EXPECT_FALSE(Reaches(first, second) || Reaches(second, first)) << seed;
    EXPECT_FALSE(Reaches(first, board) || Reaches(board, first)) << seed;
    EXPECT_FALSE(Reaches(second, board) || Reaches(board, second)) << seed;
  }
}

TEST(RotateValve, TheBoardIsOnlyInItsVariation) {
  const auto has_board = [](const std::string& name) {
    const std::vector<ScenePart> parts = FindTask(name).task.parts;
    return std::any_of(parts.begin(), parts.end(),
                       [](const ScenePart& part) { return part.name == "obstacle"; });
  };
  EXPECT_FALSE(has_board("rotate_valve/position_and_orientation"));
  EXPECT_TRUE(has_board("rotate_valve/obstacle"));

  const std::filesystem::path file = ModelsFolder() / "tasks/rotate_valve.yaml";
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  std::string twice = text.str();
  const std::string name = "- name: obstacle";
  twice.replace(twice.find(name), name.size(), "- name: table");
  try {
    ParseTask(twice, file, true);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("another part has the name 'table'"), std::string::npos)
        << error.what();
  }
}

}  // namespace evalbus::policy::hinge_experts_test
