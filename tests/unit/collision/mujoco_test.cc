// Compares the checker with MuJoCo's own collision detection on random poses. Both use libccd for general
// convex shapes, so this test does not verify depths independently. closed_form_test.cc does.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include "tests/unit/collision/collision_scene.h"
#include "tests/unit/collision/two_arms.h"

namespace evalbus::collision::mujoco_test {

// The scene has at least two free bodies of every shape over a floor. EveryShape() adds the mesh "pebble".
const char kEveryShape[] = R"(<mujoco>
  <size njmax="5000" nconmax="1000"/>
  <asset><mesh name="wedge" vertex="0 0 0  .2 0 0  0 .15 0  0 0 .1  .2 .15 .05  .1 .05 .12"/>
         <mesh name="cube" vertex="-.05 -.05 -.05 .05 -.05 -.05 -.05 .05 -.05 .05 .05 -.05
                                   -.05 -.05 .05 .05 -.05 .05 -.05 .05 .05 .05 .05 .05"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 .1" pos="0 0 -.1" euler="5 3 0"/>
    <body name="s1"><freejoint/><geom type="sphere" size=".06"/></body>
    <body name="s2"><freejoint/><geom type="sphere" size=".1" pos=".02 0 .01"/></body>
    <body name="c1"><freejoint/><geom type="capsule" size=".05 .12"/></body>
    <body name="c2"><freejoint/><geom type="capsule" size=".03 .08" euler="30 20 10"/></body>
    <body name="y1"><freejoint/><geom type="cylinder" size=".06 .1"/></body>
    <body name="y2"><freejoint/><geom type="cylinder" size=".1 .03"/></body>
    <body name="e1"><freejoint/><geom type="ellipsoid" size=".05 .08 .11"/></body>
    <body name="e2"><freejoint/><geom type="ellipsoid" size=".1 .04 .06"/></body>
    <body name="b1"><freejoint/><geom type="box" size=".05 .08 .1"/></body>
    <body name="b2"><freejoint/><geom type="box" size=".12 .02 .07"/></body>
    <body name="m1"><freejoint/><geom type="mesh" mesh="wedge"/></body>
    <body name="m2"><freejoint/><geom type="mesh" mesh="cube"/></body>
    <body name="m3"><freejoint/><geom type="mesh" mesh="pebble"/></body>
  </worldbody></mujoco>)";

// Returns a scene with every shape. One is a hull of 80 corners, because above 32 corners FCL finds the
// farthest corner by walking along edges.
std::string EveryShape() {
  std::string vertices;
  for (int i = 0; i < 80; ++i) {
    const double z = 1 - (2 * i + 1) / 80.0;
    const double r = std::sqrt(1 - z * z);
    vertices += std::to_string(0.1 * r * std::cos(2.4 * i)) + " " +
                std::to_string(0.08 * r * std::sin(2.4 * i)) + " " + std::to_string(0.05 * z) + " ";
  }
  std::string xml = kEveryShape;
  return xml.insert(xml.find("</asset>"), "<mesh name='pebble' vertex='" + vertices + "'/>");
}

using PairKey = std::pair<int, int>;

// Returns MuJoCo's contacts, with the deepest distance of each pair.
std::map<PairKey, double> MujocoContacts(const CollisionScene& scene) {
  mj_collision(scene.model.get(), scene.data.get());
  std::map<PairKey, double> result;
  for (int i = 0; i < scene.data->ncon; ++i) {
    const mjContact& contact = scene.data->contact[i];
    const PairKey key = std::minmax(contact.geom1, contact.geom2);
    const auto [place, added] = result.emplace(key, contact.dist);
    if (!added) place->second = std::min(place->second, contact.dist);
  }
  return result;
}

// The results of one pass over random poses.
struct Tally {
  int both = 0;
  std::map<std::pair<int, int>, int> both_of_types;
};

// Compares the touching pairs of one pose, and their depth and normal where these have to agree.
//
// If only one side reports a pair, the pair may be at most kBand deep. The band absorbs rounding near
// touching, because libccd's detection stops at 1e-6. Depths agree to 1e-12 where both sides have a closed
// form. Elsewhere MuJoCo 2.2 uses libccd's MPR, which searches along one direction and can only overestimate.
// Therefore our depth (the smallest over all directions, to 1e-6) must not be larger.
constexpr double kBand = 1e-6;

void Compare(CollisionScene* scene, CollisionChecker* checker, Tally* tally) {
  const mjModel& m = *scene->model;
  scene->SetPoses(checker);
  std::map<PairKey, double> expected = MujocoContacts(*scene);
  // MuJoCo lets these pairs collide, but the checker does not: neighbors fixed to the world, and fingers of
  // one hand.
  std::erase_if(expected, [&](const auto& entry) {
    return !checker->IsChecked(entry.first.first, entry.first.second);
  });
  for (const contact_t& contact : checker->FindContacts()) {
    const std::pair<int, int> types = std::minmax(m.geom_type[contact.geom_a], m.geom_type[contact.geom_b]);
    SCOPED_TRACE("geoms " + std::to_string(contact.geom_a) + " and " + std::to_string(contact.geom_b) +
                 " of types " + std::to_string(types.first) + " and " + std::to_string(types.second));
    const auto other = expected.find({contact.geom_a, contact.geom_b});
    if (other == expected.end()) {
      // MuJoCo 2.2 misses capsules that pass through a box.
      if (types == std::pair<int, int>{mjGEOM_CAPSULE, mjGEOM_BOX} && contact.distance_m < -0.02) continue;
      EXPECT_GE(contact.distance_m, -kBand);
      continue;
    }
    const double ours = contact.distance_m;
    const double theirs = other->second;
    const bool round = types.first == mjGEOM_SPHERE || types.first == mjGEOM_CAPSULE;
    const bool closed_form = types.first == mjGEOM_PLANE ||
                             (round && (types.second == mjGEOM_SPHERE || types.second == mjGEOM_CAPSULE));
    if (closed_form) {
      EXPECT_NEAR(ours, theirs, 1e-12);
    } else if (types.second != mjGEOM_BOX || types.first > mjGEOM_CAPSULE) {
      if (types != std::pair<int, int>{mjGEOM_BOX, mjGEOM_BOX}) {
        EXPECT_GE(ours, theirs - 3e-6);
      }
    }
    ++tally->both;
    ++tally->both_of_types[types];
    expected.erase(other);
  }
  for (const auto& [pair, distance] : expected) {
    EXPECT_GE(distance, -kBand) << "only MuJoCo has geoms " << pair.first << " and " << pair.second;
  }
}

TEST(CollisionAgainstMujoco, TouchingPairsOfEveryShapeAgreeOnRandomPoses) {
  CollisionScene scene(EveryShape());
  CollisionChecker checker(scene.model.get(), scene.info);
  std::mt19937_64 random(1);
  Tally tally;
  for (int i = 0; i < 6000; ++i) {
    scene.Randomize(&random, 0.25);
    Compare(&scene, &checker, &tally);
    if (HasFailure()) FAIL() << "pose " << i;
  }
  // 7 shapes form 28 kinds of pairs. All but plane on plane occur, each hundreds of times.
  EXPECT_EQ(tally.both_of_types.size(), 27u);
  for (const auto& [types, count] : tally.both_of_types) {
    EXPECT_GT(count, 300) << types.first << " and " << types.second;
  }
}

TEST(CollisionAgainstMujoco, TouchingPairsOfTwoArmsAgreeOnRandomPoses) {
  CollisionScene scene(TwoArmsXml());
  CollisionChecker checker(scene.model.get(), scene.info);
  std::mt19937_64 random(2);
  Tally tally;
  for (int i = 0; i < 4000; ++i) {
    scene.Randomize(&random, 0.6);
    // The pot floats within reach of the arms.
    double* pot = scene.data->qpos + scene.model->nq - 7;
    pot[0] += 0.6;
    pot[2] += 0.9;
    mj_kinematics(scene.model.get(), scene.data.get());
    Compare(&scene, &checker, &tally);
    if (HasFailure()) FAIL() << "pose " << i;
  }
  EXPECT_GT(tally.both, 5000);
}

bool SameBits(const std::vector<contact_t>& a, const std::vector<contact_t>& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const contact_t& x, const contact_t& y) {
           return x.geom_a == y.geom_a && x.geom_b == y.geom_b &&
                  std::memcmp(&x.distance_m, &y.distance_m, sizeof x.distance_m) == 0 &&
                  std::memcmp(x.position_m, y.position_m, sizeof x.position_m) == 0 &&
                  std::memcmp(x.normal, y.normal, sizeof x.normal) == 0;
         });
}

TEST(CollisionChecker, ResultsAreSortedAndDependOnPosesOnly) {
  for (const std::string& xml : {EveryShape(), TwoArmsXml()}) {
    CollisionScene scene(xml);
    CollisionChecker used(scene.model.get(), scene.info);
    std::mt19937_64 random(3);
    for (int i = 0; i < 300; ++i) {
      scene.Randomize(&random, 0.3);
      // `used` has checked other poses before, and `fresh` has not.
      CollisionChecker fresh(scene.model.get(), scene.info);
      scene.SetPoses(&fresh);
      scene.SetPoses(&used);
      const std::vector<contact_t> first = fresh.FindContacts();
      EXPECT_TRUE(SameBits(first, used.FindContacts()));
      EXPECT_TRUE(SameBits(first, used.FindContacts()));
      const std::optional<Clearance> a = fresh.FindClearance();
      const std::optional<Clearance> b = used.FindClearance();
      ASSERT_EQ(a.has_value(), b.has_value());
      if (a) {
        EXPECT_EQ(a->distance, b->distance);
        EXPECT_EQ(a->robot_geom, b->robot_geom);
        EXPECT_EQ(a->scene_geom, b->scene_geom);
      }
      EXPECT_TRUE(SameBits(first, used.FindContacts()));
      for (size_t k = 0; k < first.size(); ++k) {
        EXPECT_LT(first[k].geom_a, first[k].geom_b);
        EXPECT_NEAR(mju_norm3(first[k].normal), 1, 1e-9);
        EXPECT_LE(first[k].distance_m, contact_t::TOUCH_DISTANCE_M);
        if (k > 0) {
          EXPECT_LT(std::pair(first[k - 1].geom_a, first[k - 1].geom_b),
                    std::pair(first[k].geom_a, first[k].geom_b));
        }
      }
    }
  }
}

}  // namespace evalbus::collision::mujoco_test
