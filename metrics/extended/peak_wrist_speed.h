// Peak speed of each wrist. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Largest norm(p_i - p_(i-1)) / dt over consecutive samples, m/s; 0 if there are none.
class PeakWristSpeed : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"peak_wrist_speed_mps"};
  explicit PeakWristSpeed(const MetricsConfig& config) : peak_(config.arms.size()) {}

  void Start() override { peak_.assign(peak_.size(), 0); }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < peak_.size(); ++k) peak_[k] = std::max(peak_[k], derived.wrist_speed[k]);
  }
  void Values(std::span<double> values) const override {
    std::copy(peak_.begin(), peak_.end(), values.begin());
  }

 private:
  std::vector<double> peak_;
};

}  // namespace evalbus::metrics
