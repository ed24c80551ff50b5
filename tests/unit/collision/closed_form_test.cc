// Distance, point and normal of single pairs. Expected values were computed by hand or, for polytopes, by
// testing every separating axis.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "tests/unit/collision/collision_scene.h"

namespace evalbus::collision::closed_form_test {

using Eigen::Quaterniond;
using Eigen::Vector3d;

const char kMeshes[] = R"(<asset>
  <mesh name="cube" vertex="-.1 -.1 -.1 .1 -.1 -.1 -.1 .1 -.1 .1 .1 -.1 -.1 -.1 .1 .1 -.1 .1 -.1 .1 .1 .1 .1 .1"/>
  <mesh name="wedge" vertex="0 0 0  .2 0 0  0 .15 0  0 0 .1  .2 .15 .05  .1 .05 .12"/></asset>)";

// Two free geoms, "a" and "b", each given by its attributes.
class TwoGeoms {
 public:
  TwoGeoms(const std::string& a, const std::string& b)
      : scene_(std::string("<mujoco>") + kMeshes + "<worldbody>" + Body("a", a) + Body("b", b) +
               "</worldbody></mujoco>"),
        checker_(scene_.model.get(), scene_.info) {
    Place(1, Vector3d::Zero(), Quaterniond::Identity());
    Place(2, Vector3d::Zero(), Quaterniond::Identity());
    const double origin[3] = {0, 0, 0};
    const double unit[4] = {1, 0, 0, 0};
    checker_.SetBodyPose(0, origin, unit);
  }

  // Sets the pose of the geom frame, which MuJoCo places at the center of mass for meshes.
  void Place(int body, const Vector3d& p, const Quaterniond& q) {
    const double quat[4] = {q.w(), q.x(), q.y(), q.z()};
    checker_.SetBodyPose(body, p.data(), quat);
  }

  std::optional<contact_t> Check() {
    const std::vector<contact_t>& contacts = checker_.FindContacts();
    if (contacts.empty()) return std::nullopt;
    EXPECT_EQ(contacts.size(), 1u);
    return contacts[0];
  }

  // Places b and expects this contact with a.
  void Expect(const Vector3d& p_b, const Quaterniond& q_b, double distance, const Vector3d& point,
              const Vector3d& normal, double tolerance = 1e-12) {
    Place(2, p_b, q_b);
    const std::optional<contact_t> contact = Check();
    ASSERT_TRUE(contact);
    EXPECT_EQ(contact->geom_a, 0);
    EXPECT_EQ(contact->geom_b, 1);
    EXPECT_NEAR(contact->distance_m, distance, tolerance);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(contact->position_m[i], point[i], tolerance) << "point " << i;
      EXPECT_NEAR(contact->normal[i], normal[i], tolerance) << "normal " << i;
    }
  }

  void ExpectApart(const Vector3d& p_b, const Quaterniond& q_b = Quaterniond::Identity()) {
    Place(2, p_b, q_b);
    EXPECT_FALSE(Check());
  }

  // Returns the world coordinates of the corners of a box's or mesh geom's convex hull, for the given body
  // poses.
  std::vector<Vector3d> Corners(int geom, const Vector3d& p, const Quaterniond& q) const {
    const mjModel& m = *scene_.model;
    std::vector<Vector3d> corners;
    const Vector3d offset(m.geom_pos[3 * geom], m.geom_pos[3 * geom + 1], m.geom_pos[3 * geom + 2]);
    const double* g = m.geom_quat + 4 * geom;
    const auto add = [&](const Vector3d& corner) {
      corners.push_back(p + q * (offset + Quaterniond(g[0], g[1], g[2], g[3]) * corner));
    };
    if (m.geom_type[geom] == mjGEOM_MESH) {
      const int mesh = m.geom_dataid[geom];
      for (int i = 0; i < m.mesh_vertnum[mesh]; ++i) {
        const float* v = m.mesh_vert + 3 * (m.mesh_vertadr[mesh] + i);
        add(Vector3d(v[0], v[1], v[2]));
      }
    } else {
      const double* s = m.geom_size + 3 * geom;
      for (int i = 0; i < 8; ++i) {
        add(Vector3d(i & 1 ? s[0] : -s[0], i & 2 ? s[1] : -s[1], i & 4 ? s[2] : -s[2]));
      }
    }
    return corners;
  }

 private:
  static std::string Body(const std::string& name, const std::string& geom) {
    return "<body name=\"" + name + "\"><freejoint/><geom " + geom + " mass=\"1\"/></body>";
  }

  CollisionScene scene_;
  CollisionChecker checker_;
};

const Quaterniond kUnit = Quaterniond::Identity();
Quaterniond Turn(double degrees, const Vector3d& axis) {
  return Quaterniond(Eigen::AngleAxisd(degrees * mjPI / 180, axis.normalized()));
}

TEST(CollisionClosedForm, SphereOnSphere) {
  TwoGeoms dut("type='sphere' size='.1'", "type='sphere' size='.2'");
  dut.Expect({0, 0.25, 0}, kUnit, -0.05, {0, 0.075, 0}, {0, 1, 0});
  dut.Expect({-0.29, 0, 0}, kUnit, -0.01, {-0.095, 0, 0}, {-1, 0, 0});
  dut.ExpectApart({0, 0, 0.3 + 2e-8});
  dut.Expect({0, 0, 0.3 + 0.5e-8}, kUnit, 0.5e-8, {0, 0, 0.1}, {0, 0, 1}, 1e-8);
}

TEST(CollisionClosedForm, ConcentricSpheresHaveSomeUnitNormal) {
  TwoGeoms dut("type='sphere' size='.1'", "type='sphere' size='.2'");
  const std::optional<contact_t> contact = dut.Check();
  ASSERT_TRUE(contact);
  EXPECT_NEAR(contact->distance_m, -0.3, 1e-12);
  EXPECT_NEAR(mju_norm3(contact->normal), 1, 1e-12);
}

TEST(CollisionClosedForm, CrossedAndParallelCapsules) {
  TwoGeoms dut("type='capsule' size='.05 .3'", "type='capsule' size='.04 .2'");
  // b lies along x, 0.08 above a's axis in y.
  dut.Expect({0, 0.08, 0.1}, Turn(90, Vector3d::UnitY()), -0.01, {0, 0.045, 0.1}, {0, 1, 0});
  // The capsules are parallel and shifted. Their axes overlap in z from 0.2 to 0.3.
  dut.Expect({0.08, 0, 0.4}, kUnit, -0.01, {0.045, 0, 0.25}, {1, 0, 0});
  // The capsules are end to end.
  dut.Expect({0, 0, 0.58}, kUnit, -0.01, {0, 0, 0.345}, {0, 0, 1});
  // The axes intersect. The exit direction is perpendicular to both, which are z and (cos 37, sin 37, 0).
  const double turn = 37 * mjPI / 180;
  dut.Place(2, {0, 0, 0}, Turn(37, Vector3d::UnitZ()) * Turn(90, Vector3d::UnitY()));
  const std::optional<contact_t> contact = dut.Check();
  ASSERT_TRUE(contact);
  EXPECT_NEAR(contact->distance_m, -0.09, 1e-12);
  EXPECT_NEAR(std::abs(contact->normal[0] * -std::sin(turn) + contact->normal[1] * std::cos(turn)), 1, 1e-12);
  dut.ExpectApart({0.0901, 0, 0});
}

TEST(CollisionClosedForm, SphereAgainstCapsule) {
  TwoGeoms dut("type='sphere' size='.1'", "type='capsule' size='.05 .2'");
  dut.Expect({0.14, 0, 0.1}, kUnit, -0.01, {0.095, 0, 0}, {1, 0, 0});
  dut.Expect({0, 0, 0.34}, kUnit, -0.01, {0, 0, 0.095}, {0, 0, 1});
}

TEST(CollisionClosedForm, SphereAgainstBox) {
  TwoGeoms dut("type='sphere' size='.1'", "type='box' size='.1 .2 .3'");
  // The sphere touches a face, an edge and a corner. In the fourth case its center is inside the box, nearest
  // to the -x face.
  dut.Expect({0.19, 0.05, 0}, kUnit, -0.01, {0.095, 0, 0}, {1, 0, 0});
  const double diagonal = std::sqrt(0.5);
  dut.Expect({0.1 + 0.09 * diagonal, 0.2 + 0.09 * diagonal, 0}, kUnit, -0.01,
             {0.095 * diagonal, 0.095 * diagonal, 0}, {diagonal, diagonal, 0});
  const Vector3d corner = Vector3d::Ones() / std::sqrt(3.0);
  dut.Expect(Vector3d(0.1, 0.2, 0.3) + 0.08 * corner, kUnit, -0.02, 0.09 * corner, corner);
  dut.Expect({0.07, 0, 0}, kUnit, -0.13, {0.035, 0, 0}, {1, 0, 0});
}

TEST(CollisionClosedForm, CapsuleAgainstBox) {
  TwoGeoms dut("type='box' size='.1 .1 .1'", "type='capsule' size='.05 .2'");
  // The capsule lies on the top face, with three quarters of its axis beyond the side. The point is at the
  // middle of the part above the box, x from 0 to 0.1.
  dut.Expect({0.2, 0, 0.14}, Turn(90, Vector3d::UnitY()), -0.01, {0.05, 0, 0.095}, {0, 0, 1}, 1e-9);
  // The capsule stands on the top face.
  dut.Expect({0.03, 0.02, 0.34}, kUnit, -0.01, {0.03, 0.02, 0.095}, {0, 0, 1});
  // The capsule lies across an edge, with its axis at 45 degrees to both faces. The edge (x = z = 0.1) is
  // 0.03 from the axis.
  const double diagonal = std::sqrt(0.5);
  dut.Expect({0.1 + 0.03 * diagonal, 0, 0.1 + 0.03 * diagonal}, Turn(135, Vector3d::UnitY()), -0.02,
             {0.1 - 0.01 * diagonal, 0, 0.1 - 0.01 * diagonal}, {diagonal, 0, diagonal});
  // The capsule comes from above, with one end 0.02 deep inside the box.
  dut.Expect({0, 0, 0.28}, kUnit, -0.07, {0, 0, 0.065}, {0, 0, 1});
  dut.ExpectApart({0.1501, 0, 0});
}

TEST(CollisionClosedForm, CapsuleThroughBoxLeavesByTheShortestWay) {
  TwoGeoms dut("type='box' size='.1 .2 .3'", "type='capsule' size='.05 .5'");
  // The axis passes through the box along y at x = 0.06, so the exit is through +x after 0.04 + 0.05.
  dut.Expect({0.06, 0, 0}, Turn(90, Vector3d::UnitX()), -0.09, {0.055, 0, 0}, {1, 0, 0});
}

TEST(CollisionClosedForm, BoxFaceOnBoxFace) {
  TwoGeoms dut("type='box' size='.1 .2 .3'", "type='box' size='.05 .05 .05'");
  dut.Place(2, {0.14, 0.02, 0.03}, kUnit);
  const std::optional<contact_t> contact = dut.Check();
  ASSERT_TRUE(contact);
  EXPECT_NEAR(contact->distance_m, -0.01, 1e-12);
  EXPECT_NEAR(contact->normal[0], 1, 1e-12);
  // The point may be anywhere in the common area of the faces.
  EXPECT_NEAR(contact->position_m[0], 0.095, 1e-12);
  EXPECT_LE(std::abs(contact->position_m[1] - 0.02), 0.05);
  EXPECT_LE(std::abs(contact->position_m[2] - 0.03), 0.05);
  dut.ExpectApart({0.15 + 2e-8, 0, 0});
  dut.Place(2, {0.15 + 0.5e-8, 0, 0}, kUnit);
  EXPECT_TRUE(dut.Check());
}

TEST(CollisionClosedForm, BoxContainedInBox) {
  TwoGeoms dut("type='box' size='.5 .5 .5'", "type='box' size='.05 .05 .05'");
  dut.Place(2, {0.3, 0.1, -0.1}, kUnit);
  const std::optional<contact_t> contact = dut.Check();
  ASSERT_TRUE(contact);
  EXPECT_NEAR(contact->distance_m, -0.25, 1e-12);  // 0.2 to the +x face plus 0.05
  EXPECT_NEAR(contact->normal[0], 1, 1e-12);
}

TEST(CollisionClosedForm, PlaneUnderEveryShape) {
  // The plane is tilted by 30 degrees about y and passes through (0, 0, 1).
  const Quaterniond q = Turn(30, Vector3d::UnitY());
  const Vector3d n = q * Vector3d::UnitZ();
  const std::string floor = "<geom type='plane' size='1 1 1' pos='0 0 1' euler='0 30 0'/>";
  const auto check = [&](const std::string& geom, const Quaterniond& q_local, double reach,
                         const Vector3d& lowest) {
    // `lowest` is the lowest point relative to the body's origin, in the frame of the plane. `reach` is its
    // depth below the origin.
    CollisionScene scene(std::string("<mujoco>") + kMeshes + "<worldbody>" + floor +
                         "<body name='b'><freejoint/><geom " + geom +
                         " mass='1'/></body></worldbody></mujoco>");
    CollisionChecker checker(scene.model.get(), scene.info);
    const Quaterniond q_b = q * q_local;
    const Vector3d p_b = Vector3d(0, 0, 1) + (reach - 0.01) * n + q * Vector3d(0.3, -0.2, 0);
    const double quat[4] = {q_b.w(), q_b.x(), q_b.y(), q_b.z()};
    scene.SetPoses(&checker);
    checker.SetBodyPose(1, p_b.data(), quat);
    const std::vector<contact_t>& contacts = checker.FindContacts();
    ASSERT_EQ(contacts.size(), 1u) << geom;
    EXPECT_NEAR(contacts[0].distance_m, -0.01, 1e-7 * (geom.find("mesh") != geom.npos) + 1e-12) << geom;
    const Vector3d point = p_b + q * lowest + 0.005 * n;
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(contacts[0].normal[i], n[i], 1e-12) << geom;
      EXPECT_NEAR(contacts[0].position_m[i], point[i], 1e-7) << geom;
    }
  };
  check("type='sphere' size='.1'", kUnit, 0.1, {0, 0, -0.1});
  check("type='capsule' size='.05 .2'", kUnit, 0.25, {0, 0, -0.25});
  check("type='capsule' size='.05 .2'", Turn(90, Vector3d::UnitX()), 0.05, {0, 0, -0.05});
  check("type='cylinder' size='.05 .2'", kUnit, 0.2, {0, 0, -0.2});
  check("type='cylinder' size='.05 .2'", Turn(90, Vector3d::UnitX()), 0.05, {0, 0, -0.05});
  // The cylinder is tilted by 45 degrees about x, so a point on the rim is the lowest.
  const double diagonal = std::sqrt(0.5);
  check("type='cylinder' size='.05 .2'", Turn(45, Vector3d::UnitX()), 0.25 * diagonal,
        {0, 0.15 * diagonal, -0.25 * diagonal});
  check("type='ellipsoid' size='.1 .2 .3'", kUnit, 0.3, {0, 0, -0.3});
  check("type='box' size='.1 .2 .3'", kUnit, 0.3, {0, 0, -0.3});
  // The box stands on an edge, and then on a corner, where all three half extents project onto the normal.
  check("type='box' size='.1 .1 .1'", Turn(45, Vector3d::UnitX()), 0.2 * diagonal, {0, 0, -0.2 * diagonal});
  const Quaterniond corner_down = Quaterniond::FromTwoVectors(Vector3d::Ones(), -Vector3d::UnitZ());
  check("type='box' size='.1 .1 .1'", corner_down, 0.1 * std::sqrt(3.0), {0, 0, -0.1 * std::sqrt(3.0)});
  check("type='mesh' mesh='cube'", kUnit, 0.1, {0, 0, -0.1});
}

TEST(CollisionClosedForm, PlaneGivenSecondTurnsTheNormal) {
  CollisionScene scene(R"(<mujoco><worldbody>
    <body name="a"><freejoint/><geom type="sphere" size=".1"/></body>
    <body name="fixture" mocap="true"><geom type="plane" size="1 1 1"/></body></worldbody></mujoco>)");
  CollisionChecker checker(scene.model.get(), scene.info);
  scene.SetPoses(&checker);
  const std::vector<contact_t>& contacts = checker.FindContacts();
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_NEAR(contacts[0].distance_m, -0.1, 1e-12);
  EXPECT_NEAR(contacts[0].normal[2], -1, 1e-12);  // from the sphere down to the plane
}

TEST(CollisionClosedForm, CylinderAgainstSphereAndBox) {
  {
    TwoGeoms dut("type='cylinder' size='.1 .2'", "type='sphere' size='.05'");
    // On curved shapes, EPA's tolerance is 1e-6 for the depth. Its point and normal are less exact.
    dut.Expect({0, 0.14, 0.05}, kUnit, -0.01, {0, 0.095, 0.05}, {0, 1, 0}, 5e-3);
    EXPECT_NEAR(dut.Check()->distance_m, -0.01, 1e-6);
    dut.Expect({0.03, 0, 0.24}, kUnit, -0.01, {0.03, 0, 0.195}, {0, 0, 1}, 5e-3);
    EXPECT_NEAR(dut.Check()->distance_m, -0.01, 1e-6);
  }
  TwoGeoms dut("type='cylinder' size='.1 .2'", "type='box' size='.3 .3 .3'");
  dut.Place(2, {0, 0, -0.49}, kUnit);
  EXPECT_NEAR(dut.Check()->distance_m, -0.01, 1e-6);
  EXPECT_NEAR(dut.Check()->normal[2], -1, 1e-6);
  dut.Place(2, {0.39, 0, 0}, kUnit);
  EXPECT_NEAR(dut.Check()->distance_m, -0.01, 1e-6);
  EXPECT_NEAR(dut.Check()->normal[0], 1, 1e-3);
}

TEST(CollisionClosedForm, EllipsoidsAlongTheirAxes) {
  TwoGeoms dut("type='ellipsoid' size='.1 .2 .3'", "type='ellipsoid' size='.05 .1 .2'");
  dut.Place(2, {0, 0, 0.49}, kUnit);
  EXPECT_NEAR(dut.Check()->distance_m, -0.01, 1e-6);
  EXPECT_NEAR(dut.Check()->position_m[2], 0.295, 1e-3);
  EXPECT_NEAR(dut.Check()->normal[2], 1, 1e-3);
  dut.ExpectApart({0, 0, 0.5001});
}

// Returns the exact penetration depth of two convex polytopes. It is the smallest overlap over all directions
// that can be a facet normal of their Minkowski difference: normals of corner triples and products of corner
// differences. Superfluous directions do no harm.
double PolytopeDepth(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  double best = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Vector3d& direction) {
    if (direction.norm() < 1e-7) return;
    const Vector3d u = direction.normalized();
    const auto range = [&](const std::vector<Vector3d>& corners) {
      std::pair<double, double> r(1e9, -1e9);
      for (const Vector3d& corner : corners) {
        r.first = std::min(r.first, corner.dot(u));
        r.second = std::max(r.second, corner.dot(u));
      }
      return r;
    };
    const auto ra = range(a);
    const auto rb = range(b);
    best = std::min({best, ra.second - rb.first, rb.second - ra.first});
  };
  for (const auto* s : {&a, &b}) {
    for (size_t i = 0; i < s->size(); ++i) {
      for (size_t j = 0; j < i; ++j) {
        for (size_t k = 0; k < j; ++k) consider(((*s)[i] - (*s)[k]).cross((*s)[j] - (*s)[k]));
      }
    }
  }
  for (size_t i = 0; i < a.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      for (size_t k = 0; k < b.size(); ++k) {
        for (size_t l = 0; l < k; ++l) consider((a[i] - a[j]).cross(b[k] - b[l]));
      }
    }
  }
  return best;
}

TEST(CollisionClosedForm, DepthOfPolytopesIsTheSmallestOverAllSeparatingAxes) {
  std::mt19937_64 random(7);
  const auto uniform = [&] { return 2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1; };
  const std::pair<const char*, const char*> cases[] = {
      {"type='box' size='.05 .08 .1'", "type='box' size='.12 .02 .07'"},
      {"type='box' size='.05 .08 .1'", "type='mesh' mesh='wedge'"},
      {"type='mesh' mesh='cube'", "type='mesh' mesh='wedge'"},
      {"type='mesh' mesh='cube'", "type='box' size='.1 .1 .1'"}};
  for (const auto& [a, b] : cases) {
    TwoGeoms dut(a, b);
    int touching = 0;
    for (int i = 0; i < 1500; ++i) {
      const Vector3d p(0.15 * uniform(), 0.15 * uniform(), 0.15 * uniform());
      // Every tenth pose is aligned with the world axes, so faces and edges are parallel.
      const Quaterniond q =
          i % 10 == 0 ? kUnit : Quaterniond(uniform(), uniform(), uniform(), uniform()).normalized();
      dut.Place(2, p, q);
      const double depth = PolytopeDepth(dut.Corners(0, Vector3d::Zero(), kUnit), dut.Corners(1, p, q));
      const std::optional<contact_t> contact = dut.Check();
      if (std::abs(depth) < 1e-7) continue;  // mesh corners have single precision
      ASSERT_EQ(contact.has_value(), depth > 0) << a << " and " << b << ", pose " << i << ", depth " << depth;
      if (!contact) continue;
      ++touching;
      ASSERT_NEAR(contact->distance_m, -depth, 1e-6) << a << " and " << b << ", pose " << i;
      // The normal points outward. Moving b by the depth separates the pair, and a shorter move does not.
      const Vector3d n(contact->normal[0], contact->normal[1], contact->normal[2]);
      dut.Place(2, p + (depth + 2e-6) * n, q);
      EXPECT_FALSE(dut.Check()) << a << " and " << b << ", pose " << i;
      dut.Place(2, p + 0.99 * depth * n, q);
      EXPECT_TRUE(dut.Check());
      // The point is outside each shape by at most half the depth.
      const Vector3d point(contact->position_m[0], contact->position_m[1], contact->position_m[2]);
      EXPECT_GT(PolytopeDepth(dut.Corners(0, Vector3d::Zero(), kUnit), {point}), -0.5 * depth - 1e-6);
      EXPECT_GT(PolytopeDepth(dut.Corners(1, p, q), {point}), -0.5 * depth - 1e-6);
    }
    EXPECT_GT(touching, 300) << a << " and " << b;
  }
}

// At this distance, FCL's two algorithms may disagree on whether the shapes touch.
TEST(ClosedForm, NormalsAreUnitVectorsAtTheTouchDistance) {
  TwoGeoms pair("type='box' size='.5 .5 .1'", "type='cylinder' size='.1 .1'");
  int contacts = 0;
  for (int i = 0; i < 4000; ++i) {
    const double error = std::pow(10.0, -16 + i % 5) * (i % 2 == 0 ? 1 : -1);
    const Vector3d position(0.1 * std::sin(i), 0.1 * std::cos(2 * i),
                            0.2 + contact_t::TOUCH_DISTANCE_M + error);
    pair.Place(2, position, Quaterniond(Eigen::AngleAxisd(0.1 * i, Vector3d::UnitZ())));
    const std::optional<contact_t> contact = pair.Check();
    if (!contact) continue;
    ++contacts;
    const Vector3d normal(contact->normal[0], contact->normal[1], contact->normal[2]);
    ASSERT_NEAR(normal.norm(), 1, 1e-9) << i;
  }
  EXPECT_GT(contacts, 100);
}

}  // namespace evalbus::collision::closed_form_test
