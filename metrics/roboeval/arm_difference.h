// Differences between the two arms. Source: RoboEval's metrics page (bimanual_arm_velocity_difference,
// bimanual_gripper_vertical_difference).
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

#include "evalbus/metric_values_t.hpp"
#include "metrics/sample/derived_sample.h"

namespace evalbus::metrics {

// Mean over samples of |x left - x right|, where x is a quantity of an arm. The value is 0 unless there are
// two arms.
template <double (*kQuantity)(const ArmSample&), auto kFlag, auto kMean>
class ArmDifference {
 public:
  static constexpr auto kTracked = kFlag;
  explicit ArmDifference(const MetricsConfig&) {}

  void Start(const ResetState&) { sum_ = count_ = 0; }
  void Add(const DerivedSample& derived) {
    const std::span<const ArmSample> arm = derived.sample.arm;
    if (arm.size() != 2) return;
    sum_ += std::abs(kQuantity(arm[0]) - kQuantity(arm[1]));
    ++count_;
  }
  void Values(metric_values_t* values) const { values->*kMean = count_ > 0 ? sum_ / count_ : 0; }

 private:
  double sum_ = 0;
  int64_t count_ = 0;
};

// Returns the norm of the measured joint velocities, rad/s.
inline double SpeedOfJoints(const ArmSample& arm) {
  double sum = 0;
  for (double value : arm.joint_velocity) sum += value * value;
  return std::sqrt(sum);
}

// Returns the height of the wrist, m.
inline double HeightOfWrist(const ArmSample& arm) { return arm.wrist_position[2]; }

// Despite RoboEval's name of the metric, the value is a difference of speeds, not of velocities.
using ArmSpeedDifference = ArmDifference<SpeedOfJoints, &metric_values_t::tracks_vel_sync,
                                         &metric_values_t::bimanual_arm_velocity_difference_radps>;
using GripperHeightDifference = ArmDifference<HeightOfWrist, &metric_values_t::tracks_vertical_sync,
                                              &metric_values_t::bimanual_gripper_vertical_difference_m>;

}  // namespace evalbus::metrics
