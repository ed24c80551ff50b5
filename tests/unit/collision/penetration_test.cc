// For these inputs, rounding leaves the expanding polytope without faces, or lets the number of its faces
// grow without end.
#include "collision/penetration.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace evalbus::collision::penetration_test {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Matrix3d Turned(double w, double x, double y, double z) {
  return Quaterniond(w, x, y, z).normalized().toRotationMatrix();
}

Shape Box(const Vector3d& half_extents, const Matrix3d& rotation, const Vector3d& position) {
  return {.kind = Shape::Kind::kBox,
          .size = half_extents,
          .corners = {},
          .position = position,
          .rotation = rotation};
}

Shape Cylinder(double radius, double half_length, const Matrix3d& rotation) {
  return {.kind = Shape::Kind::kCylinder,
          .size = {radius, half_length, 0},
          .corners = {},
          .position = Vector3d::Zero(),
          .rotation = rotation};
}

// Returns the depth of a box in a cylinder at the origin whose axis is one of the box's axes.
double ParallelDepth(const Shape& cylinder, const Shape& box) {
  const Vector3d offset = cylinder.rotation.transpose() * box.position;
  double depth = cylinder.size[1] + box.size[2] - std::abs(offset.z());
  constexpr int kDirections = 1000000;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * std::numbers::pi * i / kDirections, x = std::cos(angle), y = std::sin(angle);
    const double reach = std::abs(x) * box.size[0] + std::abs(y) * box.size[1];
    depth = std::min(depth, cylinder.size[0] + reach - x * offset.x() - y * offset.y());
  }
  return depth;
}

// Without the check that the surface is closed, these cases never end, because the number of faces grows with
// each step.
TEST(Penetration, ABoxInACylinderWithParallelAxes) {
  const auto expect = [](double radius, double half_length, const Matrix3d& rotation,
                         const Vector3d& half_extents, const Vector3d& position) {
    const Shape cylinder = Cylinder(radius, half_length, rotation),
                box = Box(half_extents, rotation, position);
    const std::optional<Proximity> found = Penetration(cylinder, box);
    ASSERT_TRUE(found);
    EXPECT_NEAR(-found->distance, ParallelDepth(cylinder, box), 1e-5);
    EXPECT_NEAR(found->normal.norm(), 1, 1e-12);
    EXPECT_TRUE(found->point.allFinite());
  };
  expect(0.86, 0.68, Turned(-9, 3, 0, 2), {0.067, 0.027, 0.54}, {0.15, 0.13, 0.18});
  expect(0.61, 0.83, Turned(0, 7, 8, -4), {0.022, 0.16, 0.014}, {-0.2, -0.012, -0.021});
  expect(0.72, 0.4, Turned(-8, 9, -6, 2), {0.016, 0.041, 0.6}, {-0.17, -0.12, 0.0027});
  expect(0.44, 0.12, Turned(6, 8, 4, 5), {0.074, 0.016, 0.32}, {-0.15, -0.24, 0.057});
}

// The new vertex sees every face, because rounding decides the orientation of a sliver that is 50 m long and
// a few nm wide. Without the check that the surface is closed, a build with _GLIBCXX_ASSERTIONS (the
// sanitizer presets) aborts here, and other builds read a deleted face.
TEST(Penetration, Needles) {
  const auto expect = [](const Matrix3d& rotation, const Vector3d& a, const Vector3d& b,
                         const Vector3d& position) {
    const std::optional<Proximity> found =
        Penetration(Box(a, rotation, Vector3d::Zero()), Box(b, rotation, position));
    ASSERT_TRUE(found);
    // The exact depth is a few nm.
    EXPECT_GE(-found->distance, 0);
    EXPECT_LE(-found->distance, 1e-5);
    EXPECT_TRUE(found->point.allFinite());
    EXPECT_NEAR(found->normal.norm(), 1, 1e-12);
  };
  expect(Turned(2, -8, 0, -7), {2.5e-07, 6.6e-09, 17}, {2.6e-09, 1.3e-09, 94}, {0, 0, 0});
  expect(Turned(9, 2, -5, 3), {2.7e-09, 5.6e-09, 36}, {9.8e-07, 1.7e-09, 53}, {0, 0, 0});
  expect(Turned(3, 3, 1, -6), {2.3e-09, 5.5e-09, 31}, {8.8e-08, 1.5e-08, 38}, {-3.6, -3.6, 4.2});
  expect(Turned(2, -4, 4, 0), {9.1e-09, 6e-07, 7.8}, {1e-09, 1.8e-09, 94}, {40, 40, -70});
  expect(Turned(-3, -5, -6, -8), {3e-09, 2.9e-07, 65}, {1.2e-09, 2.8e-09, 42}, {0, 0, 0});
}

}  // namespace evalbus::collision::penetration_test
