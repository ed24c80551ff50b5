// Time for which each arm stands still. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "lcmtypes/clock.h"
#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// An arm is idle while all of its joints are slower than this (rad/s).
inline constexpr double kIdleJointSpeed = 0.01;

// Computes for each arm the sum of dt over all samples in which it is idle (s).
class IdleTime : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"idle_time_s"};
  explicit IdleTime(const MetricsConfig& config) : dt_(config.control_dt), samples_(config.arms.size()) {}

  void Start() override { samples_.assign(samples_.size(), 0); }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < samples_.size(); ++k) {
      const std::span<const double> velocity = derived.sample.arm[k].joint_velocity;
      samples_[k] += std::all_of(velocity.begin(), velocity.end(),
                                 [](double v) { return std::abs(v) < kIdleJointSpeed; });
    }
  }
  void Values(std::span<double> values) const override {
    for (size_t k = 0; k < samples_.size(); ++k) values[k] = TickTime(samples_[k], dt_);
  }

 private:
  double dt_;
  std::vector<int64_t> samples_;
};

}  // namespace evalbus::metrics
