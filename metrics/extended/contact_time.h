// Time in contact with the scene. Defined by evalbus (docs/metrics.md).
#pragma once

#include "lcmtypes/clock.h"
#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Sum of dt (s) over all samples in which a robot geom touches a scene geom.
class ContactTime : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"contact_time_s"};
  explicit ContactTime(const MetricsConfig& config) : dt_(config.control_dt) {}

  void Start() override { samples_ = 0; }
  void Add(const DerivedSample& derived) override { samples_ += !derived.contacts.scene().empty(); }
  void Values(std::span<double> values) const override { values[0] = TickTime(samples_, dt_); }

 private:
  double dt_;
  int64_t samples_ = 0;
};

}  // namespace evalbus::metrics
