// Smallest distance of the arms from their joint limits. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <limits>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Smallest distance (rad) of any arm joint to its nearer limit; negative beyond the limit. A joint with lower
// >= upper has no limits. There is no value before the first sample, or if no joint has limits.
class JointLimitMargin : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"min_joint_limit_margin_rad"};
  explicit JointLimitMargin(const MetricsConfig& config) : arms_(config.arms) {}

  void Start() override { margin_ = kNone; }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < arms_.size(); ++k) {
      const std::span<const double> q = derived.sample.arm[k].joint_position;
      const std::vector<double>&lower = arms_[k].joint_lower, &upper = arms_[k].joint_upper;
      for (size_t j = 0; j < lower.size(); ++j) {
        if (lower[j] < upper[j]) margin_ = std::min({margin_, q[j] - lower[j], upper[j] - q[j]});
      }
    }
  }
  void Values(std::span<double> values) const override {
    values[0] = margin_ < kNone ? margin_ : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<ArmConfig> arms_;
  double margin_ = kNone;
};

}  // namespace evalbus::metrics
