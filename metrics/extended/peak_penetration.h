// Deepest penetration of the robot. Ours (docs/metrics.md).
#pragma once

#include "metrics/extended_metric.h"

namespace evalbus {

// Largest penetration (m, >= 0) of any contact with a robot geom in it, manipulated objects included.
class PeakPenetration : public ExtendedMetric {
 public:
  static std::vector<ValueName> Names(const MetricsConfig&) { return {{"peak_penetration_m", "m"}}; }
  explicit PeakPenetration(const MetricsConfig&) {}

  void Start() override { depth_ = 0; }
  void Add(const DerivedSample& derived) override {
    for (const GeomContact& contact : derived.sample.contacts) {
      if (-contact.distance > depth_ &&
          (derived.owners.IsRobot(contact.geom_a) || derived.owners.IsRobot(contact.geom_b))) {
        depth_ = -contact.distance;
      }
    }
  }
  void Values(std::span<double> values) const override { values[0] = depth_; }

 private:
  double depth_ = 0;
};

inline const bool kPeakPenetrationRegistered = RegisterExtendedMetric<PeakPenetration>();

}  // namespace evalbus
