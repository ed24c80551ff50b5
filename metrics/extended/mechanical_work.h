// Mechanical work of each arm. Ours (docs/metrics.md).
#pragma once

#include <cmath>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Sum over samples of |torque . velocity| dt, J: the magnitude of the arm's mechanical power, so that braking
// costs too.
class MechanicalWork : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"mechanical_work_J"};
  explicit MechanicalWork(const MetricsConfig& config) : dt_(config.control_dt), sum_(config.arms.size()) {}

  void Start() override { sum_.assign(sum_.size(), 0); }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < sum_.size(); ++k) {
      const ArmSample& arm = derived.sample.arm[k];
      double power = 0;
      for (size_t j = 0; j < arm.joint_torque.size(); ++j)
        power += arm.joint_torque[j] * arm.joint_velocity[j];
      sum_[k] += std::abs(power);
    }
  }
  void Values(std::span<double> values) const override {
    for (size_t k = 0; k < sum_.size(); ++k) values[k] = sum_[k] * dt_;
  }

 private:
  double dt_;
  std::vector<double> sum_;  // W
};

}  // namespace evalbus::metrics
