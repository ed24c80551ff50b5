// Pose repeatability over episodes with equal start parameters, similar to ISO 9283:1998, which measures how
// far a robot's attained poses scatter when the same motion is repeated.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "metrics/sample/rotation_angle.h"
#include "metrics/statistics/describe.h"
#include "models/pose.h"

namespace evalbus::metrics {

// For fewer poses, no repeatability is computed, because its standard deviation would be too uncertain. ISO
// 9283 measures 30 cycles.
inline constexpr size_t kFewestToRepeat = 10;

struct PoseRepeatability {
  double position = 0;  // m
  double rotation = 0;  // rad
};

// Returns the mean plus three sample standard deviations. For distances, this is the repeatability RP of ISO
// 9283.
inline double MeanPlusThreeS(std::span<const double> x) { return Mean(x) + 3 * StandardDeviation(x); }

// Returns the normalized sum of the quaternions. A quaternion is negated before it is added if this brings it
// nearer to the first quaternion.
inline std::array<double, 4> MeanOrientation(std::span<const Pose> poses) {
  std::array<double, 4> mean{};
  for (const Pose& pose : poses) {
    double dot = 0;
    for (size_t k = 0; k < 4; ++k) dot += pose.quaternion[k] * poses[0].quaternion[k];
    for (size_t k = 0; k < 4; ++k) mean[k] += dot < 0 ? -pose.quaternion[k] : pose.quaternion[k];
  }
  const double norm = std::hypot(std::hypot(mean[0], mean[1]), std::hypot(mean[2], mean[3]));
  for (double& value : mean) value /= norm;
  return mean;
}

// position: MeanPlusThreeS() of the distances of the positions from their mean (the barycenter). rotation:
// MeanPlusThreeS() of the angles between the orientations and their mean orientation. ISO 9283 instead uses
// three standard deviations of each of three angles, which depend on the choice of the axes. Requires at
// least two poses.
inline PoseRepeatability RepeatabilityOf(std::span<const Pose> poses) {
  std::array<double, 3> center{};
  for (const Pose& pose : poses) {
    for (size_t k = 0; k < 3; ++k) center[k] += pose.position[k] / static_cast<double>(poses.size());
  }
  const std::array<double, 4> mean = MeanOrientation(poses);
  std::vector<double> distances, angles;
  for (const Pose& pose : poses) {
    const auto& p = pose.position;
    distances.push_back(std::hypot(p[0] - center[0], p[1] - center[1], p[2] - center[2]));
    angles.push_back(RotationAngle(pose.quaternion, mean));
  }
  return {.position = MeanPlusThreeS(distances), .rotation = MeanPlusThreeS(angles)};
}

}  // namespace evalbus::metrics
