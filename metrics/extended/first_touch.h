// When a gripper first touches an object. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <limits>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Simulated time (s) of the first sample in which a gripper's pad touches a manipulated object. There is no
// value if none does.
class FirstTouch : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"first_touch_s"};
  explicit FirstTouch(const MetricsConfig& /*config*/) {}

  void Start() override { time_ = kNone; }
  void Add(const DerivedSample& derived) override {
    const std::span<const uint8_t> holding = derived.sample.holding;
    const bool touches = std::any_of(holding.begin(), holding.end(), [](uint8_t held) { return held != 0; });
    if (touches && !(time_ >= 0)) time_ = derived.sample.time;
  }
  void Values(std::span<double> values) const override { values[0] = time_; }

 private:
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double time_ = kNone;
};

}  // namespace evalbus::metrics
