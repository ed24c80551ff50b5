// Difference between the speeds of the two arms. Source: RoboEval's metrics page
// (bimanual_arm_velocity_difference).
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

#include "evalbus/metric_values_t.hpp"
#include "metrics/sample/derived_sample.h"

namespace evalbus::metrics {

// Mean over samples of |norm(w left) - norm(w right)|, rad/s, where w are the measured joint velocities. It
// is a difference of speeds, not of velocities. The value is 0 unless there are two arms.
class ArmSpeedDifference {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_vel_sync;
  explicit ArmSpeedDifference(const MetricsConfig&) {}

  void Start(const ResetState&) { sum_ = count_ = 0; }
  void Add(const DerivedSample& derived) {
    const std::span<const ArmSample> arm = derived.sample.arm;
    if (arm.size() != 2) return;
    sum_ += std::abs(Norm(arm[0].joint_velocity) - Norm(arm[1].joint_velocity));
    ++count_;
  }
  void Values(metric_values_t* values) const {
    values->bimanual_arm_velocity_difference_radps = count_ > 0 ? sum_ / count_ : 0;
  }

 private:
  static double Norm(std::span<const double> x) {
    double sum = 0;
    for (double value : x) sum += value * value;
    return std::sqrt(sum);
  }
  double sum_ = 0;
  int64_t count_ = 0;
};

}  // namespace evalbus::metrics
