// The smallest clearance of whole episodes equals the result of measuring every tick.
#include "collision/clearance_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "models/scene.h"
#include "policy_bridge/factory.h"
#include "sim/world.h"
#include "tests/unit/collision/collision_scene.h"

namespace evalbus::collision::clearance_watch_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Played {
  std::string task;
  std::string policy;
  int ticks;
  int substeps = 10;
};

// Measures every tick in both ways.
class Comparison {
 public:
  Comparison(const mjModel* model, const model_info_t& info, int64_t tick_us)
      : checker_(model, info),
        all_(model, info),
        watch_(&checker_, tick_us),
        shown_every_(std::max<int64_t>(1, ClearanceWatch::kShownEveryUs / tick_us)) {}

  void Start() {
    watch_.Start();
    smallest_ = expected_ = kInfinity;
  }
  void Tick(int64_t tick, const mjModel& model, const double* position, const double* quat) {
    for (int body = 0; body < model.nbody; ++body) {
      for (CollisionChecker* checker : {&checker_, &all_})
        checker->SetBodyPose(body, position + 3 * body, quat + 4 * body);
    }
    const std::optional<Clearance> expected = all_.FindClearance();
    ASSERT_TRUE(expected);
    const bool touches = expected->distance <= contact_t::TOUCH_DISTANCE_M;
    touching += touches;
    const bool is_smaller = expected->distance < expected_;
    if (tick > 0) expected_ = std::min(expected_, expected->distance);
    const std::optional<Clearance> found = watch_.At(tick, checker_.FindContacts());
    ASSERT_EQ(found.has_value(), is_smaller || touches || tick % shown_every_ == 0) << "tick " << tick;
    if (found) {
      // The results are bit-identical.
      ASSERT_EQ(found->distance, expected->distance) << "tick " << tick;
      ASSERT_EQ(found->robot_geom, expected->robot_geom);
      ASSERT_EQ(found->scene_geom, expected->scene_geom);
      if (tick > 0) smallest_ = std::min(smallest_, found->distance);
    }
    ASSERT_EQ(smallest_, expected_);
    there += found.has_value();
  }

  int there = 0;
  int touching = 0;

 private:
  CollisionChecker checker_, all_;
  ClearanceWatch watch_;
  int64_t shown_every_;
  double smallest_ = kInfinity, expected_ = kInfinity;
};

class ClearanceOf : public testing::TestWithParam<Played> {};

TEST_P(ClearanceOf, WholeEpisodesIsThatOfMeasuringEveryTick) {
  const Played& played = GetParam();
  TaskSelection selection = FindTask(played.task);
  const RobotDescription robot = LoadRobot(selection.task.robot_file);
  selection.task.ApplyRobot(robot.name, robot.arm_names());
  Scene scene = BuildScene(selection.task, robot);
  scene.info.substeps = played.substeps;
  const auto policy = policy::MakePolicy(played.policy, *scene.physics, scene.info);
  sim::World world(scene.physics.get(), scene.info, robot, selection.task, played.substeps);
  Comparison comparison(scene.physics.get(), scene.info, world.tick_us());
  int ticks = 0;
  for (int64_t seed = 1; seed <= 2; ++seed) {
    world.Reset(seed, selection.task.variation(selection.variation));
    comparison.Start();
    episode_begin_t begin{};
    begin.seed = seed;
    policy->Begin(begin);
    state_t state{};
    action_t action{};
    for (int64_t tick = 0; tick < played.ticks; ++tick, ++ticks) {
      world.Fill(&state);
      state.header.tick = tick;
      state.header.sim_time_us = tick * world.tick_us();
      std::vector<double> position, quat;
      for (const body_pose_t& body : state.body) {
        position.insert(position.end(), std::begin(body.position_m), std::end(body.position_m));
        quat.insert(quat.end(), std::begin(body.quat_wxyz), std::end(body.quat_wxyz));
      }
      comparison.Tick(tick, *scene.physics, position.data(), quat.data());
      if (HasFatalFailure()) return;
      policy->Act(state, &action);
      ASSERT_EQ(world.Apply(action), "");
      ASSERT_TRUE(world.Step());
    }
  }
  EXPECT_LT(comparison.there, ticks);
  RecordProperty("ticks", ticks);
  RecordProperty("there", comparison.there);
  RecordProperty("touching", comparison.touching);
  if (played.policy == "random") {
    EXPECT_GT(comparison.touching, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(
    , ClearanceOf,
    testing::Values(Played{"lift_pot/position", "expert", 260}, Played{"lift_pot/position", "expert", 500, 1},
                    Played{"lift_tray", "expert", 250}, Played{"stack_two_blocks/position", "expert", 300},
                    Played{"pick_single_book_from_table", "expert", 250}, Played{"pack_box", "expert", 300},
                    Played{"cube_handover", "random", 500}, Played{"stack_single_book_shelf", "random", 500}),
    [](const auto& test) {
      std::string name =
          test.param.task + "_" + test.param.policy + "_" + std::to_string(test.param.substeps);
      std::replace(name.begin(), name.end(), '/', '_');
      return name;
    });

// The scene has every shape except meshes against each of these shapes, moving fixtures, and a floor.
TEST(ClearanceWatch, OfAllShapesIsThatOfMeasuringEveryTick) {
  const auto shapes = [](const std::string& robot) {
    std::string xml;
    int i = 0;
    for (const char* geom :
         {"type='sphere' size='.1'", "type='capsule' size='.05 .2'", "type='ellipsoid' size='.1 .2 .05'",
          "type='cylinder' size='.1 .1'", "type='box' size='.1 .15 .05'"}) {
      xml += "<body name='" + robot + std::to_string(i++) + "'><freejoint/><geom " + geom + "/></body>";
    }
    return xml;
  };
  CollisionScene scene("<mujoco><worldbody><geom name='floor' type='plane' size='9 9 1' pos='0 0 -2'/>" +
                       shapes("robot") + shapes("fixture") + "</worldbody></mujoco>");
  std::mt19937_64 random(7);
  Comparison comparison(scene.model.get(), scene.info, 20'000);
  int ticks = 0;
  for (int episode = 0; episode < 20; ++episode) {
    scene.Randomize(&random, 1.5);
    comparison.Start();
    mjData& data = *scene.data;
    for (int i = 0; i < scene.model->nv; ++i) {
      data.qvel[i] = (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5) * (i % 6 < 3 ? 1 : 3);
    }
    for (int64_t tick = 0; tick < 100; ++tick, ++ticks) {
      mj_integratePos(scene.model.get(), data.qpos, data.qvel, 0.02);
      mj_kinematics(scene.model.get(), &data);
      comparison.Tick(tick, *scene.model, data.xpos, data.xquat);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_LT(comparison.there, ticks);
  EXPECT_GT(comparison.touching, 100);
}

}  // namespace evalbus::collision::clearance_watch_test
