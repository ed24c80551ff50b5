// For each shipped task and variation, the scene composes, resets to valid initial states and remains at
// rest.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "base/json_file.h"
#include "metrics/task/task_evaluator.h"
#include "models/scene.h"
#include "sim/world.h"

namespace evalbus::sim::all_tasks_test {

constexpr int kSubsteps = 10;
constexpr int kSeeds = 10;
// Allowed penetration after a reset, m.
constexpr double kMaxPenetration = 1e-3;
// Times to settle and to remain at rest afterwards, s.
constexpr double kSettle = 3, kRest = 10;
// Allowed motion while settling: some tasks drop objects from about 10 cm above their support.
constexpr double kMaxSlide = 0.02, kMaxDrop = 0.15;  // m
constexpr double kMaxCreep = 1e-3;                   // m
constexpr double kMaxJointCreep = 0.01;              // rad or m

// Files are listed here but read in the tests, so that a broken file fails its own test and not all of them.
std::vector<std::filesystem::path> TaskFiles() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(ModelsFolder() / "tasks")) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  files.push_back(std::filesystem::path(EVALBUS_SOURCE_DIR) / "tests/data/models/sweep_block.yaml");
  std::sort(files.begin(), files.end());
  return files;
}

// Returns position and quaternion of every body, and every joint coordinate.
std::vector<double> Everything(const World& world) {
  const mjModel& m = world.model();
  const mjData& d = world.data();
  std::vector<double> all(d.qpos, d.qpos + m.nq);
  all.insert(all.end(), d.xpos, d.xpos + 3 * m.nbody);
  all.insert(all.end(), d.xquat, d.xquat + 4 * m.nbody);
  return all;
}

class AllTasksTest : public testing::TestWithParam<std::filesystem::path> {
 protected:
  // Calls check(task with the variation applied, variation, scene, world) for each variation.
  template <class Check>
  void ForEachVariation(const Check& check) {
    const TaskDescription described = LoadTask(GetParam());
    for (const Variation& variation : described.variations) {
      SCOPED_TRACE(described.name + "/" + variation.name);
      TaskDescription task = described;
      task.Apply(variation.name);
      const RobotDescription robot = LoadRobot(task.robot_file);
      Scene scene = BuildScene(task, robot);
      scene.info.substeps = kSubsteps;
      World world(scene.physics.get(), scene.info, robot, task, kSubsteps);
      check(task, variation, scene, &world);
    }
  }
};

TEST_P(AllTasksTest, ComposesWithoutWarningAndCanBeJudged) {
  ForEachVariation([](const TaskDescription& task, const Variation&, const Scene& scene, World*) {
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings.front();
    const ModelNames names(scene.info);
    EXPECT_NO_THROW(metrics::TaskEvaluator(task, names));
    // The number is limited, because scenes with many colliding geoms are slow.
    EXPECT_LT(scene.physics->ngeom, 100);
  });
}

TEST_P(AllTasksTest, StartsTouchButDoNotSinkIn) {
  ForEachVariation([](const TaskDescription&, const Variation& variation, const Scene& scene, World* world) {
    const model_info_t& info = scene.info;
    for (int seed = 0; seed < kSeeds; ++seed) {
      world->Reset(seed, variation);
      for (int i = 0; i < world->data().ncon; ++i) {
        const mjContact& contact = world->data().contact[i];
        const int a = info.body_entity[info.geom_body[contact.geom1]];
        const int b = info.body_entity[info.geom_body[contact.geom2]];
        if (a == b) continue;
        EXPECT_GE(contact.dist, -kMaxPenetration) << "seed " << seed << ": " << info.geom_name[contact.geom1]
                                                  << " in " << info.geom_name[contact.geom2];
      }
    }
  });
}

TEST_P(AllTasksTest, StartsAreInTheirRegionsAndMatchTheParameters) {
  ForEachVariation([](const TaskDescription& task, const Variation& variation, const Scene&, World* world) {
    for (int seed = 0; seed < kSeeds; ++seed) {
      std::map<std::string, double> value;
      for (const Parameter& parameter : world->Reset(seed, variation))
        value[parameter.name] = parameter.value;
      const auto expect_near = [&](const std::string& name, double center, double half) {
        ASSERT_TRUE(value.contains(name)) << name;
        EXPECT_LE(std::abs(value[name] - center), half + 1e-12) << name << ", seed " << seed;
      };
      for (const Randomization& randomization : variation.randomizations) {
        if (const auto* box = std::get_if<SpawnBox>(&randomization)) {
          expect_near(box->object + "_x_m", box->center[0], box->half_extents[0]);
          expect_near(box->object + "_y_m", box->center[1], box->half_extents[1]);
        }
        if (const auto* plane = std::get_if<SpawnPlane>(&randomization)) {
          for (const std::string& object : plane->objects) {
            expect_near(object + "_x_m", plane->origin[0], plane->half_extents[0] + plane->jitter[0]);
            expect_near(object + "_y_m", plane->origin[1], plane->half_extents[1] + plane->jitter[1]);
            expect_near(object + "_z_m", plane->origin[2], plane->jitter[2]);
          }
        }
        if (const auto* yaw = std::get_if<SpawnYaw>(&randomization)) {
          expect_near(yaw->object + "_yaw_rad", 0, yaw->bound);
        }
      }
      // Drawn values are applied to the world; values that are not randomized are nominal.
      for (const ScenePart& part : task.parts) {
        const int body = mj_name2id(&world->model(), mjOBJ_BODY, part.name.c_str());
        ASSERT_GT(body, 0);
        for (size_t axis = 0; axis < 3; ++axis) {
          const std::string name = part.name + "_" + "xyz"[axis] + "_m";
          const double expected = value.contains(name) ? value[name] : part.pose.position[axis];
          EXPECT_NEAR(world->data().xpos[3 * body + static_cast<int>(axis)], expected, 1e-12) << name;
        }
        const double yaw = value.contains(part.name + "_yaw_rad") ? value[part.name + "_yaw_rad"] : 0;
        const mjtNum turn[4] = {std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)};
        mjtNum expected[4];
        mju_mulQuat(expected, turn, part.pose.quaternion.data());
        double dot = 0;
        for (int i = 0; i < 4; ++i) dot += expected[i] * world->data().xquat[4 * body + i];
        EXPECT_NEAR(std::abs(dot), 1, 1e-12) << part.name;
      }
    }
  });
}

// tests/data/roboeval_starts.json has the poses of objects after env.reset(seed=...) in RoboEval's
// environment.
TEST_P(AllTasksTest, SeedsOfRoboEvalPlaceObjectsAsItDoes) {
  const auto starts = ReadJsonFile<nlohmann::json>(EVALBUS_SOURCE_DIR "/tests/data/roboeval_starts.json");
  ForEachVariation([&](const TaskDescription& task, const Variation& variation, const Scene&, World* world) {
    int compared = 0;
    for (const nlohmann::json& start : starts) {
      if (start["task"] != task.name + "/" + variation.name) continue;
      SCOPED_TRACE(start.dump());
      ++compared;
      world->Reset(start["seed"].get<int64_t>(), variation, kRoboEvalSeeds);
      const auto part = start["part"].get<std::string>();
      const int body = mj_name2id(&world->model(), mjOBJ_BODY, part.c_str());
      for (const int axis : {0, 1, 2}) {
        // If the position is not randomized, the tray of RoboEval's LiftTray has already fallen for one step.
        const double tolerance = axis == 2 && part == "tray" ? 1e-4 : 1e-11;
        EXPECT_NEAR(world->data().xpos[3 * body + axis], start["position_m"][static_cast<size_t>(axis)],
                    tolerance);
      }
      mjtNum quaternion[4];
      mju_copy4(quaternion, &world->data().xquat[4 * body]);
      // The frame of RoboEval's tray has a different orientation.
      const mjtNum turn[4] = {0.5, 0.5, 0.5, 0.5};
      if (part == "tray") mju_mulQuat(quaternion, quaternion, turn);
      double dot = 0;
      for (const size_t i : {0, 1, 2, 3}) dot += quaternion[i] * start["quaternion_wxyz"][i].get<double>();
      // If RoboEval randomizes only the cubes' positions, the cubes are tilted by 8 degrees, because its
      // reset pushes them apart.
      const bool is_tilted = variation.alias == "StackTwoBlocksPosition";
      EXPECT_NEAR(std::abs(dot), 1, is_tilted ? 0.01 : 1e-9);
    }
    EXPECT_EQ(compared > 0, !variation.randomizations.empty() && task.name != "sweep_block");
  });
}

TEST_P(AllTasksTest, EqualSeedsGiveEqualStartsAndOthersOthers) {
  ForEachVariation([](const TaskDescription&, const Variation& variation, const Scene&, World* world) {
    std::set<std::vector<double>> starts;
    world->Reset(0, variation);
    const std::vector<double> first = Everything(*world);
    for (int seed = 0; seed < kSeeds; ++seed) {
      world->Reset(seed, variation);
      starts.insert(Everything(*world));
      world->Step();
    }
    EXPECT_EQ(starts.size(), variation.randomizations.empty() ? 1u : static_cast<size_t>(kSeeds));
    world->Reset(0, variation);
    EXPECT_EQ(Everything(*world), first);
  });
}

TEST_P(AllTasksTest, PartsComeToRestAndStayThere) {
  ForEachVariation([](const TaskDescription& task, const Variation& variation, const Scene& scene,
                      World* world) {
    const model_info_t& info = scene.info;
    const mjModel& m = world->model();
    const mjData& d = world->data();
    world->Reset(1, variation);
    const auto run = [&](double seconds) {
      const int64_t ticks = std::llround(seconds * 1e6 / static_cast<double>(world->tick_us()));
      for (int64_t tick = 0; tick < ticks; ++tick) ASSERT_TRUE(world->Step()) << world->instability();
    };
    const std::vector<double> start(d.xpos, d.xpos + 3 * m.nbody);
    run(kSettle);
    for (const ScenePart& part : task.parts) {
      const int body = 3 * mj_name2id(&m, mjOBJ_BODY, part.name.c_str());
      const double *now = d.xpos + body, *then = start.data() + body;
      EXPECT_LT(std::hypot(now[0] - then[0], now[1] - then[1]), kMaxSlide) << part.name;
      EXPECT_LT(then[2] - now[2], kMaxDrop) << part.name;
    }
    const std::vector<double> position(d.xpos, d.xpos + 3 * m.nbody);
    const std::vector<double> coordinates(d.qpos, d.qpos + m.nq);
    for (int half_second = 0; half_second < 2 * kRest; ++half_second) {
      run(0.5);
      for (int body = 1; body < m.nbody; ++body) {
        if (info.entity_kind[info.body_entity[body]] == model_info_t::ROBOT) continue;
        ASSERT_LT(mju_dist3(d.xpos + 3 * body, position.data() + 3 * body), kMaxCreep)
            << info.body_name[body] << " after " << kSettle + 0.5 * (half_second + 1) << " s";
      }
      for (int joint = 0; joint < m.njnt; ++joint) {
        const int q = m.jnt_qposadr[joint];
        if (m.jnt_type[joint] == mjJNT_FREE || m.jnt_type[joint] == mjJNT_BALL) continue;
        ASSERT_NEAR(d.qpos[q], coordinates[static_cast<size_t>(q)], kMaxJointCreep) << info.joint_name[joint];
      }
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Shipped, AllTasksTest, testing::ValuesIn(TaskFiles()),
                         [](const auto& file) { return file.param.stem().string(); });

TEST(AllTasks, ANinthTaskIsJudgedWithoutCode) {
  TaskDescription task =
      FindTask(std::string(EVALBUS_SOURCE_DIR) + "/tests/data/models/sweep_block.yaml").task;
  const RobotDescription robot = LoadRobot(task.robot_file);
  Scene scene = BuildScene(task, robot);
  scene.info.substeps = kSubsteps;
  const ModelNames names(scene.info);
  metrics::TaskEvaluator evaluator(task, names);
  evaluator.Start();
  const auto geom = [&](const std::string& part) {
    for (int i = 0; i < scene.info.num_geoms; ++i) {
      if (scene.info.geom_name[i].starts_with(part + "/")) return i;
    }
    return -1;
  };
  World world(scene.physics.get(), scene.info, robot, task, kSubsteps);
  // In this world, the object is in the zone, on the table.
  task.parts[1].pose.position[1] = -0.25;
  World swept(scene.physics.get(), scene.info, robot, task, kSubsteps);
  contact_t contact{};
  contact.geom_a = geom("table");
  contact.geom_b = geom("block");
  state_t state{};
  world.Reset(0, task.variations[0]);
  world.Fill(&state);
  evaluator.Evaluate({state, {&contact, 1}}, 1);
  EXPECT_EQ(evaluator.verdict(), metrics::Verdict::kUndecided);
  EXPECT_FALSE(evaluator.stage_reached()[1]);
  swept.Reset(0, task.variations[0]);
  swept.Fill(&state);
  evaluator.Evaluate({state, {&contact, 1}}, 2);
  EXPECT_TRUE(evaluator.stage_reached()[1]);
  EXPECT_EQ(evaluator.verdict(), metrics::Verdict::kSuccess);
}

TEST(AllTasks, NamesAndAliasesFindEveryVariation) {
  std::set<std::string> names;
  for (const TaskDescription& task : AllTasks()) {
    for (const Variation& variation : task.variations) {
      for (const std::string& name : {task.name + "/" + variation.name, variation.alias}) {
        SCOPED_TRACE(name);
        EXPECT_TRUE(names.insert(name).second) << "twice";
        const TaskSelection selection = FindTask(name);
        EXPECT_EQ(selection.task.name, task.name);
        EXPECT_EQ(selection.variation, variation.name);
      }
    }
  }
  for (const char* alias : {"LiftPot",
                            "LiftPotPosition",
                            "LiftPotOrientation",
                            "LiftPotPositionAndOrientation",
                            "StackSingleBookShelf",
                            "StackSingleBookShelfPosition",
                            "StackSingleBookShelfPositionAndOrientation",
                            "PickSingleBookFromTable",
                            "PickSingleBookFromTablePosition",
                            "PickSingleBookFromTableOrientation",
                            "PickSingleBookFromTablePositionAndOrientation",
                            "StackTwoBlocks",
                            "StackTwoBlocksPosition",
                            "StackTwoBlocksOrientation",
                            "StackTwoBlocksPositionAndOrientation",
                            "CubeHandover",
                            "CubeHandoverPosition",
                            "CubeHandoverOrientation",
                            "CubeHandoverPositionAndOrientation",
                            "VerticalCubeHandover",
                            "RotateValve",
                            "RotateValvePosition",
                            "RotateValvePositionAndOrientation",
                            "RotateValveObstacle",
                            "PackBox",
                            "PackBoxPosition",
                            "PackBoxOrientation",
                            "PackBoxPositionAndOrientation",
                            "LiftTray",
                            "LiftTrayPosition",
                            "LiftTrayOrientation",
                            "LiftTrayPositionAndOrientation",
                            "DragOverAndLiftTray"}) {
    EXPECT_TRUE(names.contains(alias)) << alias;
  }
}

}  // namespace evalbus::sim::all_tasks_test
