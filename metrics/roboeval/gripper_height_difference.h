// Height difference between the two wrists. Source: RoboEval's metrics page
// (bimanual_gripper_vertical_difference).
#pragma once

#include <cmath>
#include <cstdint>

#include "evalbus/metric_values_t.hpp"
#include "metrics/sample/derived_sample.h"

namespace evalbus::metrics {

// Mean over samples of |z left - z right| of the wrists, m. 0 unless there are two arms.
class GripperHeightDifference {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_vertical_sync;
  explicit GripperHeightDifference(const MetricsConfig&) {}

  void Start(const ResetState&) { sum_ = count_ = 0; }
  void Add(const DerivedSample& derived) {
    const std::span<const ArmSample> arm = derived.sample.arm;
    if (arm.size() != 2) return;
    sum_ += std::abs(arm[0].wrist_position[2] - arm[1].wrist_position[2]);
    ++count_;
  }
  void Values(metric_values_t* values) const {
    values->bimanual_gripper_vertical_difference_m = count_ > 0 ? sum_ / count_ : 0;
  }

 private:
  double sum_ = 0;
  int64_t count_ = 0;
};

}  // namespace evalbus::metrics
