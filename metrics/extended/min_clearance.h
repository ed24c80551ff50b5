// Smallest distance between robot and scene. Defined by evalbus (docs/metrics.md).
#pragma once

#include <limits>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Smallest clearance (m) among the samples at which it was evaluated, and the simulated time (s) at which it
// first occurred. There is no value before the first such sample.
class MinClearance : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"min_clearance_m", "min_clearance_time_s"};
  explicit MinClearance(const MetricsConfig&) {}

  void Start() override { clearance_ = time_ = std::numeric_limits<double>::quiet_NaN(); }
  void Add(const DerivedSample& derived) override {
    const std::optional<double>& clearance = derived.sample.clearance;
    if (!clearance || clearance_ <= *clearance) return;
    clearance_ = *clearance;
    time_ = derived.sample.time;
  }
  void Values(std::span<double> values) const override {
    values[0] = clearance_;
    values[1] = time_;
  }

 private:
  double clearance_ = 0;
  double time_ = 0;
};

}  // namespace evalbus::metrics
