// What a metric of ours, beside RoboEval's, looks like. Each is a class in a header of its own in
// metrics/extended/, with a line in the table of extended_metrics.cc and a row for each of its names in
// lcmtypes/metric_catalog.cc; message, JSON, statistics, report and monitor take everything from there.
// A class has a constructor from MetricsConfig and kNames, its names as in extended_metrics_t; one of a kind
// by arm or gripper stands for a value for each of them. Definitions: docs/metrics.md.
#pragma once

#include <cstdint>
#include <span>

#include "metrics/sample/derived_sample.h"
#include "metrics/sample/metrics_config.h"

namespace evalbus::metrics {

class ExtendedMetric {
 public:
  virtual ~ExtendedMetric() = default;
  // Begins an episode; nothing of the one before remains.
  virtual void Start() = 0;
  // One sample; no allocation.
  virtual void Add(const DerivedSample& sample) = 0;
  // The values so far, in the order of their names; NaN where there is none. No allocation.
  virtual void Values(std::span<double> values) const = 0;
  // At the end of the episode, whose last tick this is: also what is too dear to be evaluated at every tick.
  virtual void FinalValues(int64_t /*last_tick*/, std::span<double> values) const { Values(values); }
};

}  // namespace evalbus::metrics
