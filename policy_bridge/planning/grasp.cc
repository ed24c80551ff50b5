#include "policy_bridge/planning/grasp.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace evalbus::policy {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// Largest half width of a box that fits between the fingers, m. The Franka hand opens to 0.08 m; the
// difference is a margin for errors of the approach.
constexpr double kMaxHalfWidth = 0.036;
// Largest distance (m) from the point midway between the pads to the box's near face, which must stay clear
// of the palm.
constexpr double kFingerReach = 0.03;
// Approach directions that rise more steeply than this (sine of the angle) are rejected, because the hand
// would come from below.
constexpr double kMaxRise = 0.2;

}  // namespace

Isometry3d GripFrame(const Vector3d& position, const Vector3d& approach, const Vector3d& closing) {
  Isometry3d grip;
  grip.makeAffine();
  grip.linear() << closing.cross(approach), closing, approach;
  grip.translation() = position;
  return grip;
}

std::vector<Grasp> BoxGrasps(const GraspBox& box, const Isometry3d& object, const Isometry3d& grip,
                             const std::vector<double>& leans) {
  std::vector<std::pair<double, Grasp>> found;
  for (int through = 0; through < 3; ++through) {
    for (double sign : {1.0, -1.0}) {
      const Vector3d inwards = sign * Vector3d::Unit(through);
      const double too_deep = std::max(0.0, box.half_extents[through] - kFingerReach);
      const Vector3d position = box.center - too_deep * inwards;
      for (int across = 0; across < 3; ++across) {
        if (across == through || box.half_extents[across] > kMaxHalfWidth) continue;
        for (double lean : leans) {
          const Vector3d approach = Eigen::AngleAxisd(lean, Vector3d::Unit(across)) * inwards;
          if ((object.linear() * approach).z() > kMaxRise) continue;
          for (double front : {1.0, -1.0}) {
            Grasp grasp;
            grasp.at = GripFrame(position, approach, front * Vector3d::Unit(across));
            grasp.before = Eigen::Translation3d(-kGraspApproach * approach) * grasp.at;
            const Eigen::Quaterniond turned((object * grasp.at).linear()), now(grip.linear());
            found.emplace_back(turned.angularDistance(now) + std::abs(lean), grasp);
          }
        }
      }
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Grasp> grasps;
  for (const auto& [turn, grasp] : found) grasps.push_back(grasp);
  return grasps;
}

}  // namespace evalbus::policy
