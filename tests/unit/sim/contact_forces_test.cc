// Compares contact forces of small scenes with closed forms: weight at rest, sliding friction, a drop, and a
// press between two fingers and between two arms.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <optional>
#include <string>

#include "models/mujoco_ptr.h"
#include "sim/contact_points.h"
#include "sim/force_sums.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::sim::contact_forces_test {

constexpr double kGravity = 9.81;  // m/s^2
constexpr double kStep = 0.001;    // s
enum Body { kWorld, kBox, kLeftFinger, kRightFinger };

// Kind of the bodies that slide along x on both sides of the box.
enum class Sides { kFingersOfAGripper, kArms };

// A box of 2 kg with edges of 0.1 m (or a sphere of that diameter), between two fingers or arms of 1 kg. They
// are 0.01 m away from the box and slide along x.
struct Scene {
  explicit Scene(double box_z, double finger_z, Sides sides = Sides::kFingersOfAGripper,
                 const std::string& shape = "box") {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "scene.xml";
    const auto finger = [&](const std::string& name, double x) {
      return "<body name='" + name + "' pos='" + std::to_string(x) + " 0 " + std::to_string(finger_z) +
             "'><joint name='" + name + "' type='slide' axis='1 0 0'/>" +
             "<geom type='box' size='.02 .04 .04' mass='1' friction='1 .005 .0001'/></body>";
    };
    std::ofstream(file) << "<mujoco><option timestep='0.001' cone='elliptic' impratio='10'/><worldbody>"
                           "<geom type='plane' size='5 5 .1' friction='.5 .005 .0001'/>"
                           "<body name='box' pos='0 0 " +
                               std::to_string(box_z) + "'><freejoint/><geom type='" + shape +
                               "' size='.05 .05 .05' mass='2' "
                               "friction='.5 .005 .0001'/></body>" +
                               finger("left", -0.08) + finger("right", 0.08) +
                               "</worldbody><actuator><motor joint='left'/><motor joint='right'/></actuator>"
                               "</mujoco>";
    char error[1000] = "";
    model.reset(mj_loadXML(file.c_str(), nullptr, error, sizeof(error)));
    EXPECT_TRUE(model) << error;
    data.reset(mj_makeData(model.get()));
    info.body_entity = {0, 1, 2, 3};
    info.entity_kind = {model_info_t::WORLD, model_info_t::OBJECT, model_info_t::ROBOT, model_info_t::ROBOT};
    info.object_entity = {1};
    gripper_info_t gripper{};
    gripper.pad_geom = {2, 3};
    if (sides == Sides::kFingersOfAGripper) info.gripper = {gripper};
    points.emplace(*model, info);
    sums.emplace(points->fingers(), 1, kStep);
    sums->Start();
    mj_step1(model.get(), data.get());
  }

  // Simulates one control tick and returns its state.
  state_t Tick(int steps) {
    sums->StartTick();
    for (int i = 0; i < steps; ++i) {
      points->BeforeStep(*model, data.get(), *sums);
      mj_step2(model.get(), data.get());
      sums->AddStep(points->AfterStep(*model, *data));
      mj_step1(model.get(), data.get());
    }
    state_t state{};
    state.gripper.resize(info.gripper.size());
    sums->Fill(&state);
    return state;
  }

  ModelPtr model;
  DataPtr data;
  model_info_t info{};
  std::optional<ContactPoints> points;
  std::optional<ForceSums> sums;
};

const contact_force_t& Force(const state_t& state, int a, int b) {
  for (const contact_force_t& force : state.contact_force) {
    if (force.body_a == a && force.body_b == b) return force;
  }
  static const contact_force_t none{};
  return none;
}

TEST(ContactForces, ABoxAtRestPressesWithItsWeight) {
  Scene scene(0.05, 1);
  scene.Tick(2000);
  const contact_force_t force = Force(scene.Tick(100), kWorld, kBox);
  const double weight = 2 * kGravity;
  EXPECT_EQ(force.kind, contact_force_t::OTHER);
  EXPECT_NEAR(force.mean_force_N, weight, 0.02 * weight);
  EXPECT_NEAR(force.peak_force_N, weight, 0.02 * weight);
  EXPECT_NEAR(force.impulse_Ns[2], weight * 0.1, 0.02 * weight * 0.1);
  EXPECT_EQ(force.touch_energy_J, 0);
}

// While the box slides, it rises a little in MuJoCo's soft contact, so the normal force differs slightly from
// its weight. Friction is compared with the measured normal force and with the momentum that the box lost.
TEST(ContactForces, ASlidingBoxIsBrakedByFrictionTimesTheNormalForce) {
  Scene scene(0.05, 1);
  scene.Tick(1000);
  scene.data->qvel[0] = 3;
  mj_forward(scene.model.get(), scene.data.get());
  scene.Tick(50);
  const double before_x = scene.data->qvel[0], before_z = scene.data->qvel[2];
  const contact_force_t force = Force(scene.Tick(100), kWorld, kBox);
  const double friction = -force.impulse_Ns[0], normal = force.impulse_Ns[2];
  EXPECT_GT(friction, 0.5);
  EXPECT_NEAR(friction, 0.5 * normal, 0.02 * friction);
  EXPECT_NEAR(friction, 2 * (before_x - scene.data->qvel[0]), 0.02 * friction);
  EXPECT_NEAR(normal, 2 * (kGravity * 0.1 + scene.data->qvel[2] - before_z), 0.02 * normal);
}

TEST(ContactForces, ADroppedBoxGivesItsMomentumToTheFloor) {
  Scene scene(0.05 + 0.2, 1);
  const double speed = std::sqrt(2 * kGravity * 0.2);
  double impulse = 0, energy = 0;
  for (int tick = 0; tick < 100; ++tick) {
    const contact_force_t force = Force(scene.Tick(10), kWorld, kBox);
    impulse += force.impulse_Ns[2];
    energy = std::max(energy, force.touch_energy_J);
  }
  // The floor takes the momentum of the fall and, afterwards, the weight: m g t in total.
  EXPECT_NEAR(impulse, 2 * kGravity * 1.0, 0.02 * 2 * speed);
  EXPECT_GT(energy, 0);
  // One corner hits first, so less than the whole mass resists. The energy never exceeds m v^2 / 2.
  EXPECT_LE(energy, 1.02 * 2 * speed * speed / 2);
}

// A sphere hits the floor with its whole mass, so the energy equals the energy of the fall.
TEST(ContactForces, ADroppedSphereTouchesWithTheEnergyOfItsFall) {
  for (const int steps : {2, 10, 50}) {
    SCOPED_TRACE(steps);
    Scene scene(0.05 + 0.2, 1, Sides::kFingersOfAGripper, "sphere");
    double energy = 0;
    for (int step = 0; step < 300; step += steps)
      energy = std::max(energy, Force(scene.Tick(steps), kWorld, kBox).touch_energy_J);
    const double expected = 2 * kGravity * 0.2;
    EXPECT_NEAR(energy, expected, 0.02 * expected);
  }
}

// Two arms squeeze the box without any gripper. Each presses with the force of its motor.
TEST(ContactForces, ArmsPressTheBoxBetweenThemAtAnyControlRate) {
  for (const int steps : {2, 10, 50}) {
    SCOPED_TRACE(steps);
    Scene scene(0.05, 0.05, Sides::kArms);
    scene.data->ctrl[0] = 30;
    scene.data->ctrl[1] = -30;
    mj_forward(scene.model.get(), scene.data.get());
    for (int step = 0; step < 1000; step += steps) scene.Tick(steps);
    const state_t state = scene.Tick(steps);
    for (const Body arm : {kLeftFinger, kRightFinger}) {
      const contact_force_t force = Force(state, kBox, arm);
      EXPECT_EQ(force.kind, contact_force_t::OBJECT);
      EXPECT_NEAR(force.peak_force_N, 30, 0.6);
      EXPECT_NEAR(force.mean_force_N, 30, 0.6);
      // The impulse acts on the arm, which is pushed outward.
      EXPECT_NEAR(force.impulse_Ns[0], (arm == kLeftFinger ? -30 : 30) * steps * kStep, 0.6 * steps * kStep);
    }
    ASSERT_EQ(state.object_force_N.size(), static_cast<size_t>(steps));
    for (const double force : state.object_force_N) EXPECT_NEAR(force, 30, 0.6);
    EXPECT_TRUE(state.self_force_N.empty());
  }
}

TEST(ContactForces, FingersPressWithTheirMotorsForceAtAnyControlRate) {
  for (const int steps : {2, 10, 50}) {
    SCOPED_TRACE(steps);
    Scene scene(0.05, 0.05);
    scene.data->ctrl[0] = 30;
    scene.data->ctrl[1] = -30;
    mj_forward(scene.model.get(), scene.data.get());
    double peak = 0;
    for (int step = 0; step < 1000; step += steps) {
      peak = std::max(peak, scene.Tick(steps).gripper[0].grip_force_peak_N);
    }
    const state_t state = scene.Tick(steps);
    EXPECT_NEAR(state.gripper[0].grip_force_mean_N, 30, 0.6);
    EXPECT_NEAR(state.gripper[0].grip_time_s, steps * kStep, 1e-12);
    EXPECT_NEAR(Force(state, kBox, kLeftFinger).impulse_Ns[0], -30 * steps * kStep, 0.6 * steps * kStep);
    EXPECT_NEAR(Force(state, kBox, kRightFinger).impulse_Ns[0], 30 * steps * kStep, 0.6 * steps * kStep);
    ASSERT_EQ(state.object_force_N.size(), static_cast<size_t>(steps));
    static const double first_peak = peak;
    EXPECT_EQ(peak, first_peak);
  }
}

}  // namespace evalbus::sim::contact_forces_test
