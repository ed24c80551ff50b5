// Force with which each gripper holds objects. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Computes for each gripper the mean of the grip force over the time for which it is above 0, and its peak
// (N). state_t.gripper defines the grip force, which the sim computes at every physics step. There is no
// value for a gripper that gripped nothing, or if the source does not provide forces.
class GripForce : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"grip_force_mean_N", "grip_force_peak_N"};
  explicit GripForce(const MetricsConfig& config) : grips_(config.grippers.size()) {}

  void Start() override { std::fill(grips_.begin(), grips_.end(), GripSample{}); }
  void Add(const DerivedSample& derived) override {
    if (!derived.sample.forces) return;
    for (size_t k = 0; k < grips_.size(); ++k) {
      const GripSample& grip = derived.sample.forces->grip[k];
      grips_[k].peak = std::max(grips_[k].peak, grip.peak);
      grips_[k].impulse += grip.impulse;
      grips_[k].time += grip.time;
    }
  }
  void Values(std::span<double> values) const override {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    for (size_t k = 0; k < grips_.size(); ++k) {
      const GripSample& grip = grips_[k];
      values[k] = grip.time > 0 ? grip.impulse / grip.time : kNone;
      values[grips_.size() + k] = grip.time > 0 ? grip.peak : kNone;
    }
  }

 private:
  std::vector<GripSample> grips_;
};

}  // namespace evalbus::metrics
