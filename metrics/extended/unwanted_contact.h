// How hard the robot touches what it should not touch. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <limits>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Contacts of the robot with the scene and with itself. The first value is the largest kinetic energy with
// which such a contact begins (J). The second value is the integral of the contact force over time, summed
// over all such pairs of bodies (N s). The sim integrates at every physics step. There is no value if the
// source does not provide forces.
class UnwantedContact : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"peak_touch_energy_J", "unwanted_impulse_Ns"};
  explicit UnwantedContact(const MetricsConfig& /*config*/) {}

  void Start() override {
    is_known_ = false;
    energy_ = impulse_ = 0;
  }
  void Add(const DerivedSample& derived) override {
    if (!derived.sample.forces) return;
    is_known_ = true;
    energy_ = std::max(energy_, derived.sample.forces->unwanted_touch_energy);
    impulse_ += derived.sample.forces->unwanted_impulse;
  }
  void Values(std::span<double> values) const override {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    values[0] = is_known_ ? energy_ : kNone;
    values[1] = is_known_ ? impulse_ : kNone;
  }

 private:
  bool is_known_ = false;
  double energy_ = 0, impulse_ = 0;
};

}  // namespace evalbus::metrics
