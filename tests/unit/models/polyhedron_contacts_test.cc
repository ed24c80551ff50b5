#include "models/polyhedron_contacts.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "models/mujoco_errors.h"
#include "models/mujoco_ptr.h"

namespace evalbus::polyhedron_contacts_test {

// A box, a cube of 0.2 m, an octahedron, and a bar with eight sides along x are free bodies far apart.
constexpr const char* kScene = R"(<mujoco>
  <compiler angle="radian"/>
  <custom><numeric name="polyhedron_contacts" data="1"/></custom>
  <asset>
    <mesh name="cube" vertex="-.1 -.1 -.1  .1 -.1 -.1  -.1 .1 -.1  .1 .1 -.1  -.1 -.1 .1  .1 -.1 .1  -.1 .1 .1  .1 .1 .1"/>
    <mesh name="octahedron" vertex="-.1 0 0  .1 0 0  0 -.1 0  0 .1 0  0 0 -.1  0 0 .1"/>
    <mesh name="bar" vertex="-.2 .02 .01  -.2 .01 .02  -.2 -.01 .02  -.2 -.02 .01  -.2 -.02 -.01  -.2 -.01 -.02  -.2 .01 -.02
      -.2 .02 -.01  .2 .02 .01  .2 .01 .02  .2 -.01 .02  .2 -.02 .01  .2 -.02 -.01  .2 -.01 -.02  .2 .01 -.02  .2 .02 -.01"/>
  </asset>
  <worldbody>
    <body name="box"><freejoint/><geom name="box" type="box" size="0.3 0.2 0.1"/></body>
    <body name="cube" pos="9 0 0"><freejoint/><geom name="cube" type="mesh" mesh="cube"/></body>
    <body name="octahedron" pos="18 0 0"><freejoint/><geom name="octahedron" type="mesh" mesh="octahedron"/></body>
    <body name="bar" pos="27 0 0"><freejoint/><geom name="bar" type="mesh" mesh="bar"/></body>
  </worldbody>
</mujoco>)";

struct World {
  explicit World(const std::string& xml = kScene) {
    InstallMujocoHandlers();
    const VfsPtr vfs = MakeVfs();
    AddToVfs("scene.xml", xml, vfs.get());
    char message[500] = "";
    model.reset(mj_loadXML("scene.xml", vfs.get(), message, sizeof(message)));
    EXPECT_TRUE(model) << message;
    data.reset(mj_makeData(model.get()));
  }

  int Geom(const char* name) const { return mj_name2id(model.get(), mjOBJ_GEOM, name); }

  void Place(const char* name, std::array<double, 3> position,
             std::array<double, 4> quaternion = {1, 0, 0, 0}) {
    mjtNum* pose = data->qpos + 7 * (mj_name2id(model.get(), mjOBJ_BODY, name) - 1);
    std::ranges::copy(position, pose);
    std::ranges::copy(quaternion, pose + 3);
  }

  std::vector<mjContact> Contacts() {
    mj_kinematics(model.get(), data.get());
    mj_comPos(model.get(), data.get());
    mj_collision(model.get(), data.get());
    return {data->contact, data->contact + data->ncon};
  }

  ModelPtr model;
  DataPtr data;
};

// The box is the first geom, so the normal points from the box up to the mesh.
void ExpectContact(const mjContact& contact, double depth) {
  EXPECT_NEAR(contact.dist, -depth, 1e-7);
  EXPECT_NEAR(contact.frame[0], 0, 1e-6);
  EXPECT_NEAR(contact.frame[1], 0, 1e-6);
  EXPECT_NEAR(contact.frame[2], 1, 1e-6);
  EXPECT_NEAR(contact.pos[2], 0.1 - depth / 2, 1e-6);
}

TEST(PolyhedronContacts, FaceOnFaceTouchesAtTheCornersOfTheOverlap) {
  World world;
  // The cube protrudes beyond the edges of the box at x = 0.3 and y = 0.2.
  world.Place("cube", {0.25, 0.17, 0.199});
  const std::vector<mjContact> contacts = world.Contacts();
  ASSERT_EQ(contacts.size(), 4u);
  std::vector<std::array<double, 2>> corners;
  for (const mjContact& contact : contacts) {
    ExpectContact(contact, 0.001);
    corners.push_back({std::round(1e6 * contact.pos[0]), std::round(1e6 * contact.pos[1])});
  }
  std::ranges::sort(corners);
  EXPECT_EQ(corners, (std::vector<std::array<double, 2>>{
                         {150000, 70000}, {150000, 200000}, {300000, 70000}, {300000, 200000}}));
}

TEST(PolyhedronContacts, EdgeOnFaceTouchesAtItsEnds) {
  World world;
  const double half = std::sqrt(0.5);
  // The cube is rotated by 45 degrees about y, so its lower edge is along y, from -0.1 to 0.1.
  world.Place("cube", {0, 0, 0.1 + 0.1 * std::sqrt(2) - 0.002},
              {std::cos(M_PI / 8), 0, std::sin(M_PI / 8), 0});
  std::vector<mjContact> contacts = world.Contacts();
  ASSERT_EQ(contacts.size(), 2u);
  std::ranges::sort(contacts, {}, [](const mjContact& contact) { return contact.pos[1]; });
  for (const mjContact& contact : contacts) ExpectContact(contact, 0.002);
  EXPECT_NEAR(contacts[0].pos[1], -0.1, 1e-6);
  EXPECT_NEAR(contacts[1].pos[1], 0.1, 1e-6);
  // The cube is next to the edge of the box and separated from it.
  world.Place("cube", {0.3 + 0.2 * half + 1e-4, 0, 0.1}, {std::cos(M_PI / 8), 0, std::sin(M_PI / 8), 0});
  EXPECT_EQ(world.Contacts().size(), 0u);
}

TEST(PolyhedronContacts, CornerOnFaceTouchesOnce) {
  World world;
  world.Place("octahedron", {0.05, -0.03, 0.197});
  const std::vector<mjContact> contacts = world.Contacts();
  ASSERT_EQ(contacts.size(), 1u);
  ExpectContact(contacts[0], 0.003);
  EXPECT_NEAR(contacts[0].pos[0], 0.05, 1e-6);
  EXPECT_NEAR(contacts[0].pos[1], -0.03, 1e-6);
}

// Returns the separation of two convex polyhedra by the separating-axis theorem; a negative value is minus
// the penetration depth. Independent of the tested code: tries all face normals and all cross products of
// edges.
double Separation(const World& world, const char* a, const char* b) {
  const auto corners = [&](const char* name) {
    const int geom = world.Geom(name), mesh = world.model->geom_dataid[geom];
    std::vector<std::array<double, 3>> result;
    for (int i = 0; i < (mesh < 0 ? 8 : world.model->mesh_vertnum[mesh]); ++i) {
      mjtNum local[3], corner[3];
      for (int k = 0; k < 3; ++k) {
        local[k] = mesh < 0 ? (i >> k & 1 ? 1 : -1) * world.model->geom_size[3 * geom + k]
                            : world.model->mesh_vert[3 * (world.model->mesh_vertadr[mesh] + i) + k];
      }
      mju_rotVecMat(corner, local, world.data->geom_xmat + 9 * geom);
      mju_addTo3(corner, world.data->geom_xpos + 3 * geom);
      result.push_back({corner[0], corner[1], corner[2]});
    }
    return result;
  };
  const auto first = corners(a), second = corners(b);
  double most = -std::numeric_limits<double>::infinity();
  const auto test = [&](const mjtNum u[3], const mjtNum v[3]) {
    mjtNum axis[3];
    mju_cross(axis, u, v);
    if (mju_norm3(axis) < 1e-6 * mju_norm3(u) * mju_norm3(v)) return;
    mju_normalize3(axis);
    const auto extent = [&](const auto& points) {
      std::array<double, 2> range{1e9, -1e9};
      for (const auto& point : points) {
        const double at = mju_dot3(point.data(), axis);
        range = {std::min(range[0], at), std::max(range[1], at)};
      }
      return range;
    };
    const auto p = extent(first), q = extent(second);
    most = std::max({most, q[0] - p[1], p[0] - q[1]});
  };
  // The differences of corners include all edges. Directions from other differences cannot exceed the true
  // separation.
  const auto differences = [](const auto& points) {
    std::vector<std::array<double, 3>> result;
    for (size_t i = 0; i < points.size(); ++i) {
      for (size_t k = 0; k < i; ++k)
        result.push_back(
            {points[i][0] - points[k][0], points[i][1] - points[k][1], points[i][2] - points[k][2]});
    }
    return result;
  };
  const auto edges1 = differences(first), edges2 = differences(second);
  for (const auto& u : edges1) {
    for (const auto& v : edges1) test(u.data(), v.data());
    for (const auto& v : edges2) test(u.data(), v.data());
  }
  for (const auto& u : edges2) {
    for (const auto& v : edges2) test(u.data(), v.data());
  }
  return most;
}

TEST(PolyhedronContacts, NormalIsTheShortestWayOut) {
  World world;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int touching = 0;
  const std::array<std::array<const char*, 2>, 4> pairs{
      {{"box", "bar"}, {"box", "octahedron"}, {"cube", "octahedron"}, {"octahedron", "bar"}}};
  for (int i = 0; i < 100; ++i) {
    const auto [a, b] = pairs[static_cast<size_t>(i) % 4];
    SCOPED_TRACE(std::to_string(i) + " " + a + " " + b);
    mj_resetData(world.model.get(), world.data.get());
    const auto quaternion = [&] {
      return std::array{uniform(random), uniform(random), uniform(random), uniform(random)};
    };
    world.Place(a, {0, 0, 3}, quaternion());
    world.Place(b, {0.15 * uniform(random), 0.15 * uniform(random), 3 + 0.15 * uniform(random)},
                quaternion());
    const std::vector<mjContact> contacts = world.Contacts();
    const double separation = Separation(world, a, b);
    EXPECT_EQ(contacts.empty(), separation >= 0) << separation;
    if (contacts.empty()) continue;
    ++touching;
    EXPECT_NEAR(contacts[0].dist, separation, 1e-7);
    // Moving the second solid along the normal by the depth barely separates both.
    mjtNum* moved = world.data->qpos + 7 * (world.model->geom_bodyid[contacts[0].geom2] - 1);
    mju_addToScl3(moved, contacts[0].frame, 1e-6 - contacts[0].dist);
    EXPECT_EQ(world.Contacts().size(), 0u);
  }
  EXPECT_GT(touching, 30);
}

TEST(PolyhedronContacts, BoxesDoNotTouchOutsideOneOfThem) {
  // In this pose of a finger's pad on a rod, MuJoCo 2.2.2 finds four contacts and 3.3.3 finds three.
  const std::string scene = R"(<mujoco>
  <custom><numeric name="polyhedron_contacts" data="1"/></custom>
  <worldbody><geom name="rod" type="box" size="0.02 0.1 0.02"/>
    <body name="pad"><freejoint/><geom name="pad" type="box" size="0.0085 0.004 0.0085"/></body></worldbody></mujoco>)";
  World world(scene);
  world.Place("pad", {0.01985206, -0.06488557, 0.02646232},
              {0.99947181, -0.0270425, -0.00349489, -0.01768027});
  std::vector<mjContact> contacts = world.Contacts();
  ASSERT_EQ(contacts.size(), 3u);
  const double expected[] = {-0.00112, -0.00115, -0.00094};
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(contacts[i].dist, expected[i], 1e-5);
  // The pad lies flat on the rod, so all four corners of the pad touch.
  world.Place("pad", {0, 0, 0.028});
  EXPECT_EQ(world.Contacts().size(), 4u);
}

TEST(PolyhedronContacts, OtherScenesKeepMujocosContacts) {
  std::string xml = kScene;
  const std::string number = "polyhedron_contacts";
  xml.replace(xml.find(number), number.size(), "something_else");
  World marked, unmarked(xml);
  for (World* world : {&marked, &unmarked}) world->Place("cube", {0.25, 0.17, 0.199});
  EXPECT_EQ(marked.Contacts().size(), 4u);
  // Without multiccd, MuJoCo 2.2 finds one contact.
  EXPECT_EQ(unmarked.Contacts().size(), 1u);
}

// One simulation caches the distances of geoms, the other does not: the contacts are equal bit by bit.
TEST(PolyhedronContacts, DoNotDependOnRememberedGaps) {
  World plain, remembering;
  ReserveKnownGaps(remembering.model.get());
  remembering.data.reset(mj_makeData(remembering.model.get()));
  ASSERT_GT(remembering.model->nuserdata, 0);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int touches = 0, separations = 0;
  for (int walk = 0; walk < 40; ++walk) {
    // A walk has steps of about 10 um to 1 cm, which are rotations, translations, or both.
    const double length = std::pow(10, -5 + walk % 4), move = walk % 3 == 0 ? 0 : length,
                 turn = walk % 3 == 1 ? 0 : 10 * length;
    std::array<double, 28> pose{};
    for (size_t i = 0; i < pose.size(); ++i) pose[i] = i % 7 < 3 ? 0.2 * normal(random) : normal(random);
    for (int step = 0; step < 300; ++step) {
      // The first body is at rest.
      for (size_t i = 7; i < pose.size(); ++i) pose[i] += (i % 7 < 3 ? move : turn) * normal(random);
      for (World* world : {&plain, &remembering}) {
        std::ranges::copy(pose, world->data->qpos);
        mj_normalizeQuat(world->model.get(), world->data->qpos);
      }
      const std::vector<mjContact> expected = plain.Contacts(), contacts = remembering.Contacts();
      ASSERT_EQ(contacts.size(), expected.size()) << "walk " << walk << ", step " << step;
      for (size_t i = 0; i < contacts.size(); ++i) {
        EXPECT_EQ(contacts[i].dist, expected[i].dist);
        EXPECT_TRUE(std::equal(contacts[i].frame, contacts[i].frame + 9, expected[i].frame));
        EXPECT_TRUE(std::equal(contacts[i].pos, contacts[i].pos + 3, expected[i].pos));
      }
      ++(contacts.empty() ? separations : touches);
    }
  }
  EXPECT_GT(touches, 1000);
  EXPECT_GT(separations, 1000);
}

}  // namespace evalbus::polyhedron_contacts_test
