// The checker against MuJoCo's own collision detection on random poses. Both use libccd for general convex
// shapes, so this is no independent proof of depths; collision_closed_form_test.cc has those.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include "tests/unit/collision_scene.h"

namespace evalbus {
namespace {

// Two of every shape, free, over a floor; a hull that is no box.
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
  </worldbody></mujoco>)";

using PairKey = std::pair<int, int>;

// MuJoCo's contacts: the deepest distance of each pair.
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

TEST(CollisionAgainstMujoco, TouchingPairsOfEveryShapeAgreeOnRandomPoses) {
  CollisionScene scene(kEveryShape);
  CollisionChecker checker(scene.model.get(), scene.info);
  std::mt19937_64 random(1);
  std::map<PairKey, std::array<int, 3>> count;  // by shapes: both, only us, only MuJoCo
  std::map<PairKey, double> worst_missing;
  std::map<PairKey, double> worst_depth;
  std::map<PairKey, std::vector<double>> depth_error;
  for (int i = 0; i < 6000; ++i) {
    scene.Randomise(&random, 0.25);
    scene.SetPoses(&checker);
    std::map<PairKey, double> expected = MujocoContacts(scene);
    for (const contact_t& contact : checker.FindContacts()) {
      const PairKey types =
          std::minmax(scene.model->geom_type[contact.geom_a], scene.model->geom_type[contact.geom_b]);
      const auto other = expected.find({contact.geom_a, contact.geom_b});
      if (other == expected.end()) {
        ++count[types][1];
        worst_missing[types] = std::min(worst_missing[types], contact.distance_m);
      } else {
        ++count[types][0];
        depth_error[types].push_back(std::abs(contact.distance_m - other->second));
        expected.erase(other);
      }
    }
    for (const auto& [pair, distance] : expected) {
      const PairKey types =
          std::minmax(scene.model->geom_type[pair.first], scene.model->geom_type[pair.second]);
      ++count[types][2];
      worst_missing[types] = std::min(worst_missing[types], distance);
    }
  }
  for (auto& [types, n] : count) {
    auto& e = depth_error[types];
    std::sort(e.begin(), e.end());
    std::printf(
        "%d-%d both %6d ours %4d mujoco %4d worst one-sided %.2e depth err p50 %.2e p99 %.2e max %.2e\n",
        types.first, types.second, n[0], n[1], n[2], worst_missing[types], e[e.size() / 2],
        e[e.size() * 99 / 100], e.back());
  }
}

}  // namespace
}  // namespace evalbus
