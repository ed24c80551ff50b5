// For every pair of shapes, each of the two points of a clearance lies on the surface of its shape, and their
// distance is the clearance. Some expected values were computed by hand.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/unit/collision/collision_scene.h"

namespace evalbus::collision::clearance_points_test {

using Eigen::Vector3d;

Vector3d Point(const std::array<double, 3>& point) { return {point[0], point[1], point[2]}; }

// Returns the distance of a point from the surface of a box with these half sizes around the origin.
double ToBox(const Vector3d& p, const Vector3d& half) {
  const Vector3d out = p.cwiseAbs() - half;
  const double outside = out.cwiseMax(0).norm();
  return outside > 0 ? outside : -out.maxCoeff();
}

// A shape in MJCF, and a function for the distance (m) of a point in the shape's frame from its surface. For
// an ellipsoid the distance is a first-order approximation.
struct Kind {
  std::string mjcf;
  double (*to_surface)(const Vector3d& p);
};

const std::vector<Kind> kKinds = {
    {R"(type="sphere" size=".05")", [](const Vector3d& p) { return std::abs(p.norm() - .05); }},
    {R"(type="capsule" size=".04 .1")",
     [](const Vector3d& p) {
       return std::abs((p - Vector3d(0, 0, std::clamp(p.z(), -.1, .1))).norm() - .04);
     }},
    {R"(type="box" size=".05 .08 .03")",
     [](const Vector3d& p) {
       return ToBox(p, {.05, .08, .03});
     }},
    {R"(type="cylinder" size=".06 .09")",
     [](const Vector3d& p) {
       return ToBox({p.head<2>().norm(), p.z(), 0}, {.06, .09, 1});
     }},
    {R"(type="ellipsoid" size=".05 .08 .1")",
     [](const Vector3d& p) {
       const Vector3d scaled(p.x() / .05, p.y() / .08, p.z() / .1);
       const Vector3d slope(p.x() / (.05 * .05), p.y() / (.08 * .08), p.z() / (.1 * .1));
       return std::abs(scaled.squaredNorm() - 1) / (2 * slope.norm());
     }},
    // The mesh's principal axes, which MuJoCo sorts by decreasing inertia, are its own axes.
    {R"(type="mesh" mesh="block")",
     [](const Vector3d& p) {
       return ToBox(p, {.05, .08, .1});
     }},
};
const Kind kPlane = {R"(type="plane" size="1 1 .1")", [](const Vector3d& p) { return std::abs(p.z()); }};

constexpr char kMesh[] = R"(<asset>
  <mesh name="block" vertex="-.05 -.08 -.1 .05 -.08 -.1 -.05 .08 -.1 .05 .08 -.1
    -.05 -.08 .1 .05 -.08 .1 -.05 .08 .1 .05 .08 .1"/>
</asset>)";

CollisionScene MakeScene(const std::string& robot, const std::string& scene) {
  return CollisionScene(
      std::string("<mujoco>") + kMesh + R"(<worldbody><body name="robot"><freejoint/><geom )" + robot +
      R"(/></body><body name="fixture"><geom )" + scene + R"(/></body></worldbody></mujoco>)");
}

// Converts a point from world coordinates to the frame of a body's only geom.
Vector3d InGeom(const CollisionScene& scene, int geom, const Vector3d& point) {
  mj_forward(scene.model.get(), scene.data.get());
  const Eigen::Map<const Vector3d> position(scene.data->geom_xpos + 3 * geom);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> axes(scene.data->geom_xmat + 9 * geom);
  return axes.transpose() * (point - position);
}

void Check(const Kind& robot, const Kind& fixture) {
  CollisionScene scene = MakeScene(robot.mjcf, fixture.mjcf);
  CollisionChecker checker(scene.model.get(), scene.info);
  std::mt19937_64 random(7);
  int apart = 0, touching = 0;
  for (int k = 0; k < 200; ++k) {
    scene.Randomize(&random, 0.3);
    scene.SetPoses(&checker);
    const std::optional<Clearance> found = checker.FindClearance();
    ASSERT_TRUE(found);
    const Vector3d a = Point(found->robot_point), b = Point(found->scene_point);
    if (found->distance <= contact_t::TOUCH_DISTANCE_M) {
      EXPECT_EQ(a, b);
      EXPECT_EQ(a, Eigen::Map<const Vector3d>(checker.FindContacts().at(0).position_m));
      ++touching;
      continue;
    }
    ++apart;
    EXPECT_NEAR((b - a).norm(), found->distance, 1e-6);
    EXPECT_LT(robot.to_surface(InGeom(scene, found->robot_geom, a)), 2e-6) << "point on the robot";
    EXPECT_LT(fixture.to_surface(InGeom(scene, found->scene_geom, b)), 2e-6) << "point in the scene";
  }
  EXPECT_GT(apart, 20);
  EXPECT_GT(touching, 0);
}

TEST(ClearancePoints, LieOnBothSurfacesAtTheReportedDistance) {
  for (const Kind& robot : kKinds) {
    for (const Kind& fixture : kKinds) {
      SCOPED_TRACE(robot.mjcf + " against " + fixture.mjcf);
      Check(robot, fixture);
    }
    SCOPED_TRACE(robot.mjcf + " against a plane");
    Check(robot, kPlane);
  }
}

TEST(ClearancePoints, ByHand) {
  // A ball of 5 cm radius is 30 cm above and 4 cm to the side of the center of a box whose upper face is at 3
  // cm.
  CollisionScene scene = MakeScene(R"(type="sphere" size=".05")", R"(type="box" size=".05 .08 .03")");
  CollisionChecker checker(scene.model.get(), scene.info);
  scene.data->qpos[0] = .04;
  scene.data->qpos[2] = .3;
  mj_kinematics(scene.model.get(), scene.data.get());
  scene.SetPoses(&checker);
  const std::optional<Clearance> found = checker.FindClearance();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->distance, .22, 1e-12);
  EXPECT_LT((Point(found->robot_point) - Vector3d(.04, 0, .25)).norm(), 1e-12);
  EXPECT_LT((Point(found->scene_point) - Vector3d(.04, 0, .03)).norm(), 1e-12);
}

}  // namespace evalbus::collision::clearance_points_test
