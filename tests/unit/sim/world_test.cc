#include "sim/world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "base/errors.h"
#include "base/random.h"
#include "models/scene.h"

namespace evalbus::sim::world_test {

class WorldTest : public testing::Test {
 protected:
  static constexpr int kSubsteps = 10;

  // The scene is composed once, because worlds do not change it.
  static void SetUpTestSuite() {
    task_ = new TaskDescription(FindTask("lift_pot").task);
    robot_ = new RobotDescription(LoadRobot(task_->robot_file));
    scene_ = new Scene(BuildScene(*task_, *robot_));
  }
  static void TearDownTestSuite() {
    delete scene_;
    delete robot_;
    delete task_;
  }

  World MakeWorld() { return World(scene_->physics.get(), scene_->info, *robot_, *task_, kSubsteps); }
  const Variation& VariationOf(const std::string& name) { return task_->variation(name); }
  static state_t StateOf(const World& world) {
    state_t state{};
    world.Fill(&state);
    return state;
  }
  action_t Home() {
    action_t action{};
    action.mode = action_t::JOINT_POSITION;
    for (const ArmDescription& arm : robot_->arms) {
      action.joint_position_rad.insert(action.joint_position_rad.end(), arm.home.begin(), arm.home.end());
    }
    action.num_joints = static_cast<int32_t>(action.joint_position_rad.size());
    action.gripper_closing = {0, 0};
    action.num_grippers = 2;
    return action;
  }
  static int JointAt(const mjModel& model, int qpos) {
    return static_cast<int>(std::find(model.jnt_qposadr, model.jnt_qposadr + model.njnt, qpos) -
                            model.jnt_qposadr);
  }
  static int ActuatorOf(const mjModel& model, int joint) {
    for (int i = 0; i < model.nu; ++i) {
      if (model.actuator_trntype[i] == mjTRN_JOINT && model.actuator_trnid[2 * i] == joint) return i;
    }
    ADD_FAILURE() << "no actuator of joint " << joint;
    return 0;
  }
  static double Value(const std::vector<Parameter>& parameters, const std::string& name) {
    for (const Parameter& parameter : parameters) {
      if (parameter.name == name) return parameter.value;
    }
    ADD_FAILURE() << "no parameter " << name;
    return 0;
  }

  static TaskDescription* task_;
  static RobotDescription* robot_;
  static Scene* scene_;
};
TaskDescription* WorldTest::task_ = nullptr;
RobotDescription* WorldTest::robot_ = nullptr;
Scene* WorldTest::scene_ = nullptr;

TEST_F(WorldTest, BaseVariationStartsAtTheNominalPoseForEverySeed) {
  World world = MakeWorld();
  for (int64_t seed = 0; seed < 3; ++seed) {
    EXPECT_TRUE(world.Reset(seed, VariationOf("base")).empty());
    const state_t state = StateOf(world);
    const auto pot = static_cast<size_t>(mj_name2id(&world.model(), mjOBJ_BODY, "pot/pot"));
    ASSERT_GT(pot, 0u);
    EXPECT_THAT(state.body[pot].position_m, testing::ElementsAre(0.7, 0, 0.996));
  }
}

// The same motion is commanded at four rates. The expected work is the work of MuJoCo's actuator forces along
// the joints' motion, summed at each step of a separate simulation.
TEST_F(WorldTest, WorkIsThatOfEveryPhysicsStepAtAnyControlRate) {
  const mjModel* model = scene_->physics.get();
  for (const int substeps : {25, 10, 5, 1}) {
    SCOPED_TRACE(substeps);
    World world(model, scene_->info, *robot_, *task_, substeps);
    world.Reset(0, VariationOf("base"));
    DataPtr data(mj_copyData(nullptr, model, &world.data()));
    action_t action = Home();
    const std::vector<double> home = action.joint_position_rad;
    std::vector<double> expected(scene_->info.arm.size());
    for (int step = 0; step < 500; step += substeps) {
      for (size_t j = 0; j < home.size(); ++j) {
        action.joint_position_rad[j] =
            home[j] + 0.2 * std::sin(0.002 * step * (2 + 0.3 * static_cast<double>(j)));
      }
      ASSERT_EQ(world.Apply(action), "");
      mju_copy(data->ctrl, world.data().ctrl, model->nu);
      ASSERT_TRUE(world.Step());
      for (int i = 0; i < substeps; ++i) {
        const std::vector<double> before(data->qpos, data->qpos + model->nq);
        mj_step(model, data.get());
        for (size_t k = 0; k < expected.size(); ++k) {
          double work = 0;
          for (const int q : scene_->info.arm[k].joint_qpos_index) {
            const double way = data->qpos[q] - before[static_cast<size_t>(q)];
            work += data->actuator_force[ActuatorOf(*model, JointAt(*model, q))] * way;
          }
          expected[k] += std::abs(work);
        }
      }
    }
    const state_t state = StateOf(world);
    for (size_t k = 0; k < expected.size(); ++k) {
      EXPECT_GT(expected[k], 1);
      EXPECT_NEAR(state.arm[k].mechanical_work_J / expected[k], 1, 1e-6);
    }
    world.Reset(0, VariationOf("base"));
    EXPECT_EQ(StateOf(world).arm[0].mechanical_work_J, 0);
  }
}

TEST_F(WorldTest, HomeIsTheDescribedOne) {
  World world = MakeWorld();
  world.Reset(0, VariationOf("base"));
  const state_t state = StateOf(world);
  for (size_t arm = 0; arm < 2; ++arm) {
    EXPECT_EQ(state.arm[arm].joint_position_rad, robot_->arms[arm].home);
    EXPECT_EQ(state.gripper[arm].opening, 0);
    // Forward kinematics by hand: the base is at (0.1, +-0.3, 0.6). The upper arm adds 0.333 + 0.316 up, the
    // elbow 0.0825 forward and 0.0825 up, the forearm 0.384 forward, the wrist 0.088 forward and the flange
    // 0.107 down.
    EXPECT_NEAR(state.arm[arm].wrist_position_m[0], 0.1 + 0.0825 + 0.384 + 0.088, 1e-9);
    EXPECT_NEAR(state.arm[arm].wrist_position_m[1], arm == 0 ? 0.3 : -0.3, 1e-9);
    EXPECT_NEAR(state.arm[arm].wrist_position_m[2], 0.6 + 0.333 + 0.316 + 0.0825 - 0.107, 1e-9);
  }
}

TEST_F(WorldTest, EqualSeedsGiveEqualBitsWhateverCameBefore) {
  World a = MakeWorld();
  World b = MakeWorld();
  b.Reset(99, VariationOf("orientation"));
  b.Apply(Home());
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(b.Step());
  a.Reset(5, VariationOf("position_and_orientation"));
  b.Reset(5, VariationOf("position_and_orientation"));
  for (int i = 0; i < 50; ++i) {
    action_t action = Home();
    action.joint_position_rad[1] += 0.01 * i;
    action.gripper_closing[0] = i / 50.0;
    ASSERT_EQ(a.Apply(action), "");
    ASSERT_EQ(b.Apply(action), "");
    ASSERT_TRUE(a.Step());
    ASSERT_TRUE(b.Step());
    ASSERT_EQ(StateOf(a).qpos_mixed, StateOf(b).qpos_mixed);
    ASSERT_EQ(StateOf(a).qvel_mixed, StateOf(b).qvel_mixed);
  }
}

TEST_F(WorldTest, ARestoredStateContinuesWithEqualBits) {
  World world = MakeWorld();
  world.Reset(5, VariationOf("position"));
  const auto play = [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      action_t action = Home();
      // The action moves the arms into the pot and closes the hands.
      action.joint_position_rad[1] += 0.02 * i;
      action.joint_position_rad[8] += 0.02 * i;
      action.gripper_closing[0] = i / 60.0;
      ASSERT_EQ(world.Apply(action), "");
      ASSERT_TRUE(world.Step());
    }
  };
  play(0, 30);
  const World::Snapshot snapshot = world.Save();
  const state_t saved = StateOf(world);
  play(30, 60);
  const state_t expected = StateOf(world);
  world.Restore(snapshot);
  EXPECT_EQ(StateOf(world).qpos_mixed, saved.qpos_mixed);
  play(30, 60);
  const state_t repeated = StateOf(world);
  EXPECT_EQ(repeated.qpos_mixed, expected.qpos_mixed);
  EXPECT_EQ(repeated.qvel_mixed, expected.qvel_mixed);
  EXPECT_EQ(repeated.arm[0].joint_torque_Nm, expected.arm[0].joint_torque_Nm);
  EXPECT_EQ(repeated.arm[0].mechanical_work_J, expected.arm[0].mechanical_work_J);
  ASSERT_EQ(repeated.num_contact_forces, expected.num_contact_forces);
  for (size_t k = 0; k < expected.contact_force.size(); ++k) {
    EXPECT_EQ(repeated.contact_force[k].peak_force_N, expected.contact_force[k].peak_force_N);
    EXPECT_EQ(repeated.contact_force[k].touch_energy_J, expected.contact_force[k].touch_energy_J);
  }
}

TEST_F(WorldTest, RandomizedPosesStayInTheirRegionAndDiffer) {
  World world = MakeWorld();
  std::vector<double> xs;
  double largest_x = 0, largest_y = 0, largest_yaw = 0;
  for (int64_t seed = 0; seed < 200; ++seed) {
    const auto parameters = world.Reset(seed, VariationOf("position_and_orientation"));
    const double x = Value(parameters, "pot_x_m"), y = Value(parameters, "pot_y_m");
    const double yaw = Value(parameters, "pot_yaw_rad");
    xs.push_back(x);
    largest_x = std::max(largest_x, std::abs(x - 0.735));
    largest_y = std::max(largest_y, std::abs(y));
    largest_yaw = std::max(largest_yaw, std::abs(yaw));
    // The initial state is valid, because no penetration exceeds the depth of a resting contact.
    for (int i = 0; i < world.data().ncon; ++i) EXPECT_GT(world.data().contact[i].dist, -1e-3);
  }
  EXPECT_LE(largest_x, 0.02);
  EXPECT_LE(largest_y, 0.15);
  EXPECT_LE(largest_yaw, M_PI / 6);
  // The initial poses cover the whole region.
  EXPECT_GT(largest_x, 0.018);
  EXPECT_GT(largest_y, 0.14);
  EXPECT_GT(largest_yaw, 0.5);
  std::sort(xs.begin(), xs.end());
  EXPECT_EQ(std::unique(xs.begin(), xs.end()), xs.end());
}

TEST_F(WorldTest, ThePotStandsStillAtItsStart) {
  World world = MakeWorld();
  world.Reset(0, VariationOf("base"));
  const auto pot = static_cast<size_t>(mj_name2id(&world.model(), mjOBJ_BODY, "pot/pot"));
  world.Apply(Home());
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(world.Step());
  const body_pose_t settled = StateOf(world).body[pot];
  EXPECT_NEAR(settled.position_m[2], 0.996, 1e-3);
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(world.Step());
  const body_pose_t later = StateOf(world).body[pot];
  for (size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(later.position_m[axis], settled.position_m[axis], 1e-4);
  }
}

TEST_F(WorldTest, TheArmsHoldHomeAgainstGravity) {
  World world = MakeWorld();
  world.Reset(0, VariationOf("base"));
  world.Apply(Home());
  for (int i = 0; i < 250; ++i) ASSERT_TRUE(world.Step());
  const state_t state = StateOf(world);
  for (size_t arm = 0; arm < 2; ++arm) {
    for (size_t j = 0; j < 7; ++j) {
      EXPECT_NEAR(state.arm[arm].joint_position_rad[j], robot_->arms[arm].home[j], 8e-3);
    }
  }
}

TEST_F(WorldTest, ClipsAndCountsCommandsBeyondTheLimits) {
  World world = MakeWorld();
  world.Reset(0, VariationOf("base"));
  action_t action = Home();
  action.joint_position_rad[3] = 1;     // joint 4 ends at -0.0698
  action.joint_position_rad[8] = -100;  // right arm, joint 2
  action.gripper_closing[1] = 1.5;
  EXPECT_EQ(world.Apply(action), "");
  EXPECT_EQ(StateOf(world).action_clips, 3);
  EXPECT_NEAR(world.data().ctrl[mj_name2id(&world.model(), mjOBJ_ACTUATOR, "left/actuator4")], -0.0698, 1e-9);
  EXPECT_EQ(world.data().ctrl[mj_name2id(&world.model(), mjOBJ_ACTUATOR, "right/hand/gripper")], 0);
  world.Reset(0, VariationOf("base"));
  EXPECT_EQ(StateOf(world).action_clips, 0);
}

// The range of an actuator may be narrower than the range of its joint.
TEST_F(WorldTest, ClipsAndCountsCommandsBeyondTheRangeOfAnActuator) {
  const ModelPtr model(mj_copyModel(nullptr, scene_->physics.get()));
  const int actuator = mj_name2id(model.get(), mjOBJ_ACTUATOR, "left/actuator1");
  mjtNum* range = model->actuator_ctrlrange + 2 * actuator;
  range[0] = -0.05;
  range[1] = 0.05;
  World world(model.get(), scene_->info, *robot_, *task_, kSubsteps);
  world.Reset(0, VariationOf("base"));
  action_t action = Home();
  action.joint_position_rad[0] = 0.3;
  EXPECT_EQ(world.Apply(action), "");
  EXPECT_EQ(StateOf(world).action_clips, 1);
  EXPECT_EQ(StateOf(world).arm[0].joint_command_rad[0], 0.05);
  range[0] = 5;
  range[1] = 255;
  try {
    World(model.get(), scene_->info, *robot_, *task_, kSubsteps);
    FAIL() << "must throw";
  } catch (const InputError& error) {
    EXPECT_STREQ(
        error.what(),
        "actuator 'left/actuator1': its range, 5 to 255, contains no position of its joint, -2.8973 to "
        "2.8973 rad");
  }
}

TEST_F(WorldTest, RefusesActionsThatAreNone) {
  World world = MakeWorld();
  world.Reset(0, VariationOf("base"));
  const std::vector<double> before(world.data().ctrl, world.data().ctrl + world.model().nu);
  action_t nan = Home();
  nan.joint_position_rad[2] = std::numeric_limits<double>::quiet_NaN();
  nan.joint_position_rad[0] = 1;
  EXPECT_EQ(world.Apply(nan), "the action contains NaN or infinity");
  action_t infinite = Home();
  infinite.gripper_closing[0] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(world.Apply(infinite), "the action contains NaN or infinity");
  action_t small = Home();
  small.joint_position_rad.pop_back();
  EXPECT_EQ(world.Apply(small), "action has 13 joint and 2 gripper values, expected 14 and 2");
  action_t unknown = Home();
  unknown.mode = 7;
  EXPECT_EQ(world.Apply(unknown), "action mode 7 is unknown, expected 1 (JOINT_POSITION)");
  EXPECT_TRUE(std::equal(before.begin(), before.end(), world.data().ctrl));
}

TEST_F(WorldTest, UnstablePhysicsIsReportedAndEndsWithReset) {
  World world = MakeWorld();
  world.Reset(0, VariationOf("base"));
  const_cast<mjData&>(world.data()).qvel[0] = 1e12;
  bool stable = true;
  for (int i = 0; i < 10 && stable; ++i) stable = world.Step();
  EXPECT_FALSE(stable);
  EXPECT_NE(world.instability(), "");
  world.Reset(0, VariationOf("base"));
  EXPECT_TRUE(world.Step());
  EXPECT_EQ(world.instability(), "");
}

TEST_F(WorldTest, GridPlacesObjectsOnDistinctPoints) {
  World world = MakeWorld();
  // The grid has 0.2 // 0.05 = 4 by 0.5 // 0.05 = 9 points, because the double 0.05 slightly exceeds a tenth
  // of 0.5.
  Variation variation;
  variation.randomizations = {SpawnPlane{{"pot"}, {0.7, 0, 0.996}, {0.1, 0.25}, 0.05, {0, 0, 0}}};
  for (int64_t seed = 0; seed < 50; ++seed) {
    const auto parameters = world.Reset(seed, variation);
    const double column = (Value(parameters, "pot_x_m") - 0.7) / 0.05 + 1.5;
    const double row = Value(parameters, "pot_y_m") / 0.05 + 4;
    EXPECT_NEAR(column, std::round(column), 1e-9);
    EXPECT_NEAR(row, std::round(row), 1e-9);
    EXPECT_TRUE(column > -0.5 && column < 3.5 && row > -0.5 && row < 8.5);
  }
  std::get<SpawnPlane>(variation.randomizations[0]).spacing = 1;
  EXPECT_THROW(world.Reset(0, variation), InputError);
}

TEST_F(WorldTest, NamesWhatCannotBeRandomized) {
  World world = MakeWorld();
  Variation variation;
  variation.randomizations = {SpawnYaw{"left_cabinet", 1}};
  EXPECT_THROW(world.Reset(0, variation), InputError);
}

TEST(EpisodeSeed, DependsOnRunSeedAndEpisodeAndFitsADouble) {
  std::vector<int64_t> seeds;
  for (int64_t run = 0; run < 50; ++run) {
    for (int32_t episode = 0; episode < 50; ++episode) {
      const int64_t seed = SeedSource{run, kRunSeeds, "lift_pot", "position"}.OfEpisode(episode);
      EXPECT_GE(seed, 0);
      EXPECT_LT(seed, int64_t{1} << 53);
      seeds.push_back(seed);
    }
  }
  std::sort(seeds.begin(), seeds.end());
  EXPECT_EQ(std::unique(seeds.begin(), seeds.end()), seeds.end());
}

// Expected values come from an independent implementation in Python, in tests/bench/large_runs.py.
TEST(EpisodeSeed, IsThatOfAnIndependentImplementation) {
  const auto seed = [](const char* stream, int64_t run, int episode) {
    return SeedSource{run, stream, "lift_pot", "position"}.OfEpisode(episode);
  };
  // SplitMix64's published first output for state 0, shifted to 53 bits.
  EXPECT_EQ(seed(kSharedSeeds, 0, 0), static_cast<int64_t>(0xE220A8397B1DCDAFu >> 11));
  EXPECT_EQ(seed(kRunSeeds, 0, 0), 219242484420174);
  EXPECT_EQ(seed(kRunSeeds, 7, 3), 3413277648798279);
  EXPECT_EQ(seed(kCollectSeeds, 7, 3), 2501348859290401);
}

TEST(EpisodeSeed, IsAnotherInEachTaskVariationAndStream) {
  std::set<int64_t> seeds;
  int drawn = 0;
  for (const char* stream : {kRunSeeds, kCollectSeeds, kSharedSeeds}) {
    for (const char* task : {"lift_pot", "rotate_valve"}) {
      for (const char* variation : {"position", "orientation"}) {
        // The shared stream gives all tasks the same seeds, so it is checked only once.
        if (stream == kSharedSeeds &&
            (task != std::string("lift_pot") || variation != std::string("position")))
          continue;
        for (int episode = 0; episode < 1000; ++episode, ++drawn) {
          seeds.insert(SeedSource{0, stream, task, variation}.OfEpisode(episode));
        }
      }
    }
  }
  EXPECT_EQ(seeds.size(), static_cast<size_t>(drawn));
}

}  // namespace evalbus::sim::world_test
