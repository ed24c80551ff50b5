// How close the joints come to their torque limits. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Smallest value of 1 - |torque| / limit of any arm joint, over all physics steps. The torque includes
// gravity compensation. A joint at its limit has the value 0; beyond its limit, the value is negative. There
// is no value if no joint has a limit or the source does not provide torques.
class JointTorqueMargin : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"min_joint_torque_margin"};
  explicit JointTorqueMargin(const MetricsConfig& config) : arms_(config.arms) {}

  void Start() override { margin_ = kNone; }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < arms_.size(); ++k) {
      const std::span<const double> torque = derived.sample.arm[k].joint_torque_peak;
      const std::vector<double>& limit = arms_[k].joint_torque_limit;
      for (size_t j = 0; j < std::min(torque.size(), limit.size()); ++j) {
        if (limit[j] > 0) margin_ = std::min(margin_, 1 - torque[j] / limit[j]);
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
