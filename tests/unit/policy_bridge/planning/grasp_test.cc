#include "policy_bridge/planning/grasp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace evalbus::policy::grasp_test {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

// This hand points straight down and closes along y.
const Isometry3d kHand = GripFrame({0, 0, 1}, -Vector3d::UnitZ(), Vector3d::UnitY());

TEST(GripFrame, IsRightHanded) {
  EXPECT_NEAR(kHand.linear().determinant(), 1, 1e-12);
  EXPECT_EQ(kHand.linear().col(2), Vector3d(0, 0, -1));
  EXPECT_EQ(kHand.linear().col(1), Vector3d(0, 1, 0));
}

TEST(BoxGrasps, CubeIsTakenFromEverySideButBelow) {
  const auto grasps = BoxGrasps({Vector3d::Constant(0.02)}, Isometry3d::Identity(), kHand);
  // The grasps are from five faces, along two closing axes, with either finger in front.
  EXPECT_EQ(grasps.size(), 20u);
  EXPECT_LT((grasps[0].at.linear() - kHand.linear()).norm(), 1e-12);
  for (const Grasp& grasp : grasps) {
    EXPECT_LE(grasp.at.linear()(2, 2), 0);
    EXPECT_LT(grasp.at.translation().norm(), 1e-12);
    const Vector3d back = grasp.before.translation() - grasp.at.translation();
    EXPECT_LT((back + kGraspApproach * grasp.at.linear().col(2)).norm(), 1e-12);
  }
}

TEST(BoxGrasps, NearestTurnOfTheHandComesFirst) {
  const Isometry3d turned(AngleAxisd(std::numbers::pi / 3, Vector3d::UnitZ()));
  const auto grasps = BoxGrasps({Vector3d::Constant(0.02)}, turned, kHand);
  // The cube's sides repeat every quarter turn, so 60 degrees are equivalent to -30 degrees.
  const AngleAxisd way(Eigen::Matrix3d(kHand.linear().transpose() * turned.linear() * grasps[0].at.linear()));
  EXPECT_NEAR(way.angle(), std::numbers::pi / 6, 1e-9);
}

TEST(BoxGrasps, TooWideIsNotTakenAndTooDeepOnlyAtTheRim) {
  // The book lies flat. Only its thickness fits between the fingers, so it is grasped at its four edges.
  const Vector3d half(0.047, 0.082, 0.0135);
  const auto grasps = BoxGrasps({half}, Isometry3d::Identity(), kHand);
  EXPECT_EQ(grasps.size(), 8u);
  for (const Grasp& grasp : grasps) {
    EXPECT_NEAR(std::abs(grasp.at.linear()(2, 1)), 1, 1e-12);
    const Vector3d approach = grasp.at.linear().col(2);
    const double depth = half.dot(approach.cwiseAbs()) + grasp.at.translation().dot(approach);
    EXPECT_NEAR(depth, 0.03, 1e-12);
  }
}

TEST(BoxGrasps, LeanTurnsAboutTheClosingAxis) {
  const auto grasps = BoxGrasps({Vector3d::Constant(0.02)}, Isometry3d::Identity(), kHand, {0, 0.5});
  // There are twice as many grasps, except for those that would tilt up from two of the four sides.
  EXPECT_EQ(grasps.size(), 36u);
  for (const Grasp& grasp : grasps) {
    // The grasp still closes on two opposite faces.
    EXPECT_NEAR(grasp.at.linear().col(1).cwiseAbs().maxCoeff(), 1, 1e-12);
  }
}

}  // namespace evalbus::policy::grasp_test
