// Tests which pairs are checked, which input is rejected, and the clearance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "tests/unit/collision/collision_scene.h"
#include "tests/unit/collision/two_arms.h"

namespace evalbus::collision::pair_filter_test {

// The robot is fixed to the world and has three links in a row and a hand with two fingers. There are two
// fixtures and three objects.
const char kFilteredScene[] = R"(<mujoco><worldbody>
  <geom name="floor" type="plane" size="1 1 1"/>
  <body name="robot">
    <geom name="base" type="sphere" size=".1"/>
    <geom name="base2" type="sphere" size=".1"/>
    <body name="l1"><joint axis="0 0 1"/><geom name="l1" type="sphere" size=".1"/>
      <body name="l2"><joint axis="0 0 1"/><geom name="l2" type="sphere" size=".1"/>
        <body name="hand"><geom name="hand" type="sphere" size=".1"/>
          <body name="f1"><joint type="slide" axis="0 1 0"/><geom name="pad0a" type="sphere" size=".1"/>
            <body name="tip"><geom name="tip" type="sphere" size=".1"/></body></body>
          <body name="f2"><joint type="slide" axis="0 1 0"/><geom name="pad0b" type="sphere" size=".1"/></body>
        </body></body></body></body>
  <body name="fixture1"><geom name="table" type="box" size=".1 .1 .1"/></body>
  <body name="fixture2"><geom name="wall" type="box" size=".1 .1 .1"/></body>
  <body name="o1"><freejoint/><geom name="o1" type="sphere" size=".1"/>
    <geom name="ghost" type="sphere" size=".1" contype="0" conaffinity="0"/></body>
  <body name="o2"><freejoint/><geom name="o2" type="sphere" size=".1" contype="2" conaffinity="2"/></body>
  <body name="o3"><freejoint/><geom name="o3" type="sphere" size=".1" contype="2" conaffinity="1"/></body>
 </worldbody>
 <contact><exclude body1="o1" body2="l1"/><exclude body1="robot" body2="o1"/>
  <pair geom1="o2" geom2="o1"/></contact></mujoco>)";

TEST(CollisionFilter, FollowsMujocoAndLeavesOutNeighborsAndFingers) {
  CollisionScene scene(kFilteredScene);
  CollisionChecker checker(scene.model.get(), scene.info);
  const auto checked = [&](const char* a, const char* b) {
    const bool result = checker.IsChecked(scene.Geom(a), scene.Geom(b));
    EXPECT_EQ(result, checker.IsChecked(scene.Geom(b), scene.Geom(a)));
    return result;
  };
  // These geoms belong to one body or to bodies that are welded together.
  EXPECT_FALSE(checked("base", "base2"));
  EXPECT_FALSE(checked("l2", "hand"));
  EXPECT_FALSE(checked("pad0a", "tip"));
  // Both bodies are fixed to the world.
  EXPECT_FALSE(checked("floor", "table"));
  EXPECT_FALSE(checked("table", "wall"));
  EXPECT_FALSE(checked("base", "table"));
  EXPECT_FALSE(checked("base", "floor"));
  // Neighboring links are excluded: at the fixed base by evalbus' rule, elsewhere by MuJoCo's rule for parent
  // and child.
  EXPECT_FALSE(checked("base", "l1"));
  EXPECT_FALSE(checked("l1", "l2"));
  EXPECT_FALSE(checked("l1", "hand"));
  EXPECT_FALSE(checked("hand", "pad0a"));
  EXPECT_TRUE(checked("base", "l2"));
  EXPECT_TRUE(checked("base", "hand"));
  EXPECT_TRUE(checked("l1", "pad0a"));
  // The fingers belong to one hand.
  EXPECT_FALSE(checked("pad0a", "pad0b"));
  EXPECT_FALSE(checked("tip", "pad0b"));
  // The file excludes these bodies.
  EXPECT_FALSE(checked("o1", "l1"));
  EXPECT_FALSE(checked("base", "o1"));
  EXPECT_TRUE(checked("o1", "l2"));
  EXPECT_TRUE(checked("o1", "table"));
  EXPECT_TRUE(checked("o1", "floor"));
  // The contact types have no common bit, a common bit in one direction, or an explicit pair despite the
  // bits.
  EXPECT_FALSE(checked("ghost", "table"));
  EXPECT_FALSE(checked("o2", "table"));
  EXPECT_TRUE(checked("o3", "table"));
  EXPECT_TRUE(checked("o3", "o2"));
  EXPECT_TRUE(checked("o1", "o2"));
}

// Everything in the scene overlaps, so MuJoCo reports all pairs that it allows to collide.
TEST(CollisionFilter, ReportsNothingThatMujocoExcludes) {
  for (const char* option : {"", "<option collision='predefined'/>", "<option collision='dynamic'/>",
                             "<option><flag filterparent='disable'/></option>"}) {
    std::string xml = kFilteredScene;
    xml.insert(xml.find("<worldbody>"), option);
    CollisionScene scene(xml);
    CollisionChecker checker(scene.model.get(), scene.info);
    scene.SetPoses(&checker);
    mj_collision(scene.model.get(), scene.data.get());
    std::vector<std::pair<int, int>> mujoco;
    for (int i = 0; i < scene.data->ncon; ++i) {
      mujoco.push_back(std::minmax(scene.data->contact[i].geom1, scene.data->contact[i].geom2));
    }
    std::vector<std::pair<int, int>> ours;
    for (const contact_t& contact : checker.FindContacts()) ours.emplace_back(contact.geom_a, contact.geom_b);
    for (const auto& pair : ours) {
      EXPECT_NE(std::find(mujoco.begin(), mujoco.end(), pair), mujoco.end())
          << option << ": " << pair.first << " and " << pair.second;
    }
    // Every pair that MuJoCo checks is also checked here, except for evalbus' own exclusions.
    for (const auto& pair : mujoco) {
      EXPECT_EQ(std::find(ours.begin(), ours.end(), pair) != ours.end(),
                checker.IsChecked(pair.first, pair.second))
          << option << ": " << pair.first << " and " << pair.second;
    }
    EXPECT_FALSE(ours.empty());
  }
}

TEST(CollisionChecker, RefusesWhatDoesNotFit) {
  CollisionScene scene(kFilteredScene);
  model_info_t info = scene.info;
  ++info.num_geoms;
  EXPECT_THROW(CollisionChecker(scene.model.get(), info), InputError);
  info = scene.info;
  info.body_entity[1] = 99;
  EXPECT_THROW(CollisionChecker(scene.model.get(), info), InputError);
  info = scene.info;
  info.gripper[0].pad_geom[0] = 1000;
  EXPECT_THROW(CollisionChecker(scene.model.get(), info), InputError);

  CollisionChecker checker(scene.model.get(), scene.info);
  const double p[3] = {0, 0, std::numeric_limits<double>::quiet_NaN()};
  const double q[4] = {1, 0, 0, 0};
  const double zero[4] = {0, 0, 0, 0};
  EXPECT_THROW(checker.SetBodyPose(1, p, q), InputError);
  EXPECT_THROW(checker.SetBodyPose(1, q, zero), InputError);
  EXPECT_THROW(checker.SetBodyPose(100, q, q), InputError);
  EXPECT_THROW(checker.SetBodyPose(-1, q, q), InputError);
}

TEST(CollisionChecker, RefusesHeightFieldsByName) {
  CollisionScene scene(
      R"(<mujoco><asset><hfield name="h" nrow="3" ncol="3" size="1 1 1 1"/></asset><worldbody>
    <geom name="hills" type="hfield" hfield="h"/><body name="b"><freejoint/><geom size=".1"/></body></worldbody></mujoco>)");
  try {
    CollisionChecker checker(scene.model.get(), scene.info);
    FAIL() << "must throw";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("\"hills\""), std::string::npos) << error.what();
  }
}

TEST(CollisionChecker, RefusesAMeshWithoutItsHullByName) {
  CollisionScene scene(
      R"(<mujoco><asset><mesh name="m" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset><worldbody>
    <geom type="plane" size="1 1 1"/><body name="b"><freejoint/><geom name="wedge" type="mesh" mesh="m"/></body></worldbody></mujoco>)");
  EXPECT_NO_THROW(CollisionChecker(scene.model.get(), scene.info));
  scene.model->mesh_graphadr[0] = -1;
  try {
    CollisionChecker checker(scene.model.get(), scene.info);
    FAIL() << "must throw";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("\"wedge\" is a mesh without a convex hull"), std::string::npos)
        << error.what();
  }
}

TEST(Clearance, ByHand) {
  // The robot's tip is 0.3 - 0.1 from the table's side and 0.25 - 0.1 above the floor. The object is nearer
  // but does not count. Neither does the moving fixture (drawer), 0.05 below the base, because the base is
  // fixed to the world.
  CollisionScene scene(R"(<mujoco><worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="robot" pos="0 0 .25"><geom name="base" type="sphere" size=".2" pos="0 0 -.2"/>
      <body name="link"><joint axis="0 0 1"/><geom name="link" type="sphere" size=".02" pos=".3 0 0"/>
        <body name="tip"><joint axis="0 0 1"/><geom name="tip" type="sphere" size=".1"/></body></body></body>
    <body name="fixture" pos="0 .4 .25"><geom name="table" type="box" size=".1 .1 .1"/></body>
    <body name="fixture_drawer" pos="0 0 -.5"><joint type="slide" axis="1 0 0"/>
      <geom name="drawer" type="sphere" size=".3"/></body>
    <body name="o" pos=".15 0 .25"><freejoint/><geom name="object" type="sphere" size=".04"/></body>
    </worldbody></mujoco>)");
  CollisionChecker checker(scene.model.get(), scene.info);
  scene.SetPoses(&checker);
  std::optional<Clearance> clearance = checker.FindClearance();
  ASSERT_TRUE(clearance);
  EXPECT_NEAR(clearance->distance, 0.15, 1e-12);
  EXPECT_EQ(clearance->robot_geom, scene.Geom("tip"));
  EXPECT_EQ(clearance->scene_geom, scene.Geom("floor"));
  // The table approaches the tip and then penetrates it.
  const double q[4] = {1, 0, 0, 0};
  const double near[3] = {0, 0.31, 0.25};
  const int table = scene.model->geom_bodyid[scene.Geom("table")];
  checker.SetBodyPose(table, near, q);
  clearance = checker.FindClearance();
  EXPECT_NEAR(clearance->distance, 0.11, 1e-12);
  EXPECT_EQ(clearance->scene_geom, scene.Geom("table"));
  const double into[3] = {0, 0.17, 0.25};
  checker.SetBodyPose(table, into, q);
  EXPECT_NEAR(checker.FindClearance()->distance, -0.03, 1e-12);
}

TEST(Clearance, OfObjectsOnlyToWhatMustNotBeTouched) {
  CollisionScene scene(R"(<mujoco><worldbody>
    <body name="robot"><joint axis="0 0 1"/><geom name="tip" type="sphere" size=".1"/></body>
    <body name="o" pos=".3 0 0"><freejoint/><geom name="handle" type="sphere" size=".1"/>
      <geom name="door" type="sphere" size=".05" pos=".2 0 0"/></body>
    </worldbody></mujoco>)");
  const auto clearance = [&] {
    CollisionChecker checker(scene.model.get(), scene.info);
    scene.SetPoses(&checker);
    return checker.FindClearance();
  };
  EXPECT_FALSE(clearance());
  scene.info.forbidden_contact_geom = {scene.Geom("door")};
  scene.info.num_forbidden_contact_geoms = 1;
  ASSERT_TRUE(clearance());
  EXPECT_NEAR(clearance()->distance, 0.35, 1e-12);
  EXPECT_EQ(clearance()->scene_geom, scene.Geom("door"));
}

TEST(Clearance, AbsentWithoutRobotOrScene) {
  CollisionScene scene(R"(<mujoco><worldbody><geom type="plane" size="1 1 1"/>
    <body name="o"><freejoint/><geom size=".1"/></body></worldbody></mujoco>)");
  CollisionChecker checker(scene.model.get(), scene.info);
  scene.SetPoses(&checker);
  EXPECT_FALSE(checker.FindClearance());
}

// Compares the clearance with finely sampled distances of capsules and boxes, which are a nearly tight upper
// bound.
TEST(Clearance, OfTwoArmsIsTheLeastOverSampledPoints) {
  CollisionScene scene(TwoArmsXml());
  const mjModel& m = *scene.model;
  const mjData& d = *scene.data;
  CollisionChecker checker(&m, scene.info);
  std::mt19937_64 random(5);
  // Returns the distance of a point from a scene geom (box or plane), which is negative inside.
  const auto to_scene = [&](int geom, const double point[3]) {
    double offset[3];
    double local[3];
    mju_sub3(offset, point, d.geom_xpos + 3 * geom);
    mju_rotVecMatT(local, offset, d.geom_xmat + 9 * geom);
    if (m.geom_type[geom] == mjGEOM_PLANE) return local[2];
    double outside = 0;
    double inside = -1e9;
    for (int i = 0; i < 3; ++i) {
      const double excess = std::abs(local[i]) - m.geom_size[3 * geom + i];
      outside += std::max(excess, 0.0) * std::max(excess, 0.0);
      inside = std::max(inside, excess);
    }
    return outside > 0 ? std::sqrt(outside) : inside;
  };
  int apart = 0;
  for (int i = 0; i < 100; ++i) {
    scene.Randomize(&random, 0.3);
    scene.SetPoses(&checker);
    double sampled = 1e9;
    for (int robot = 0; robot < m.ngeom; ++robot) {
      const int body = m.geom_bodyid[robot];
      if (scene.info.entity_kind[scene.info.body_entity[body]] != model_info_t::ROBOT ||
          m.body_weldid[body] == 0)
        continue;
      const double* s = m.geom_size + 3 * robot;
      const bool capsule = m.geom_type[robot] == mjGEOM_CAPSULE;
      constexpr int kSteps = 20;
      for (int x = 0; x <= (capsule ? 0 : kSteps); ++x) {
        for (int y = 0; y <= (capsule ? 0 : kSteps); ++y) {
          for (int z = 0; z <= kSteps; ++z) {
            const auto at = [](int step, double half) { return half * (2.0 * step / kSteps - 1); };
            const double local[3] = {capsule ? 0 : at(x, s[0]), capsule ? 0 : at(y, s[1]),
                                     at(z, capsule ? s[1] : s[2])};
            double point[3];
            mju_rotVecMat(point, local, d.geom_xmat + 9 * robot);
            mju_addTo3(point, d.geom_xpos + 3 * robot);
            for (const char* name : {"floor", "counter1", "counter2"}) {
              sampled = std::min(sampled, to_scene(scene.Geom(name), point) - (capsule ? s[0] : 0));
            }
          }
        }
      }
    }
    const std::optional<Clearance> clearance = checker.FindClearance();
    ASSERT_TRUE(clearance);
    if (sampled < 0.001) continue;  // penetration is tested elsewhere
    ++apart;
    EXPECT_LE(clearance->distance, sampled + 1e-7) << "pose " << i;
    EXPECT_GE(clearance->distance, sampled - 0.006) << "pose " << i;  // half the pitch of the samples
  }
  EXPECT_GT(apart, 30);
}

}  // namespace evalbus::collision::pair_filter_test
