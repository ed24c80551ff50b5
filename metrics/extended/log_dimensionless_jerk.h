// Smoothness of each wrist's movement. Definition and source: speed_jerk.h.
#pragma once

#include "metrics/extended/speed_jerk.h"

namespace evalbus::metrics {

// Dimensionless jerk of the wrist's speed, norm(p_i - p_(i-1)) / dt.
class LogDimensionlessJerk : public SpeedJerk {
 public:
  static constexpr const char* kNames[] = {"log_dimensionless_jerk"};
  using SpeedJerk::SpeedJerk;

 private:
  double Speed(const DerivedSample& derived, size_t arm) override { return derived.wrist_speed[arm]; }
};

}  // namespace evalbus::metrics
