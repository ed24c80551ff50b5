// Quantities of an arm whose path length and jerk are metrics.
#pragma once

#include <cmath>
#include <span>

#include "metrics/sample/derived_sample.h"
#include "metrics/sample/rotation_angle.h"

namespace evalbus::metrics {

// A quantity is a vector of Dimension() numbers in each sample.
struct JointPositions {
  static int Dimension(const ArmConfig& arm) { return arm.num_joints; }
  static std::span<const double> Of(const DerivedSample& derived, size_t arm) {
    return derived.sample.arm[arm].joint_position;
  }
  // Returns norm(x - last); joint angles are not unwrapped.
  static double Distance(std::span<const double> x, std::span<const double> last) {
    double sum = 0;
    for (size_t k = 0; k < last.size(); ++k) sum += (x[k] - last[k]) * (x[k] - last[k]);
    return std::sqrt(sum);
  }
};

struct WristPosition {
  static int Dimension(const ArmConfig&) { return 3; }
  static std::span<const double> Of(const DerivedSample& derived, size_t arm) {
    return derived.sample.arm[arm].wrist_position;
  }
  static constexpr auto Distance = JointPositions::Distance;
};

struct WristOrientation {
  static int Dimension(const ArmConfig&) { return 4; }
  static std::span<const double> Of(const DerivedSample& derived, size_t arm) {
    return derived.wrist_quat[arm];
  }
  static double Distance(std::span<const double> x, std::span<const double> last) {
    return RotationAngle(x.first<4>(), last.first<4>());
  }
};

}  // namespace evalbus::metrics
