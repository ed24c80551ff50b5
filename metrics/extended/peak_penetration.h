// Deepest penetration of the robot. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Largest penetration (m, >= 0) of any contact that involves a robot geom, including contacts with
// manipulated objects.
class PeakPenetration : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"peak_penetration_m"};
  explicit PeakPenetration(const MetricsConfig&) {}

  void Start() override { depth_ = 0; }
  void Add(const DerivedSample& derived) override {
    depth_ = std::max(depth_, derived.contacts.penetration());
  }
  void Values(std::span<double> values) const override { values[0] = depth_; }

 private:
  double depth_ = 0;
};

}  // namespace evalbus::metrics
