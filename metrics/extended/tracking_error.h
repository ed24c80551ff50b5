// How far the joints are from their commands. Defined by evalbus (docs/metrics.md).
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Computes for each arm the root mean square, over samples and joints, of the commanded position minus the
// measured position at the end of the tick (rad). There is no value if the source does not provide commands.
class TrackingError : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"tracking_error_rad"};
  explicit TrackingError(const MetricsConfig& config) : sums_(config.arms.size()) {}

  void Start() override { sums_.assign(sums_.size(), {}); }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < sums_.size(); ++k) {
      const ArmSample& arm = derived.sample.arm[k];
      for (size_t j = 0; j < arm.joint_command.size(); ++j) {
        const double error = arm.joint_command[j] - arm.joint_position[j];
        sums_[k].squares += error * error;
        ++sums_[k].count;
      }
    }
  }
  void Values(std::span<double> values) const override {
    for (size_t k = 0; k < sums_.size(); ++k) {
      const auto& [squares, count] = sums_[k];
      values[k] = count > 0 ? std::sqrt(squares / static_cast<double>(count))
                            : std::numeric_limits<double>::quiet_NaN();
    }
  }

 private:
  struct Sum {
    double squares = 0;
    int64_t count = 0;
  };
  std::vector<Sum> sums_;
};

}  // namespace evalbus::metrics
