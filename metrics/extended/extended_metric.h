// Base class of the metrics that evalbus defines in addition to RoboEval's. To add one, write a class in
// metrics/extended/, add it to the table in extended_metrics.cc, and add a row for each of its names to
// lcmtypes/metric_catalog.cc. The message, JSON, statistics, report and monitor are derived from these. The
// class needs a constructor from MetricsConfig and kNames, its names as in extended_metrics_t. A name whose
// kind is by arm or by gripper stands for one value per arm or gripper. Definitions: docs/metrics.md.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include "metrics/sample/derived_sample.h"
#include "metrics/sample/metrics_config.h"

namespace evalbus::metrics {

class ExtendedMetric {
 public:
  virtual ~ExtendedMetric() = default;
  // Begins an episode and discards all state of the previous one.
  virtual void Start() = 0;
  // Adds one sample. Must not allocate in episodes of usual length; reserve the memory in the constructor.
  virtual void Add(const DerivedSample& sample) = 0;
  // Writes the values so far, in the order of their names; kNone for a value that does not exist. Must not
  // allocate.
  virtual void Values(std::span<double> values) const = 0;
  // Writes the values at the end of the episode, including those that are too expensive to compute at every
  // tick. last_tick: the episode's last tick.
  virtual void FinalValues(int64_t /*last_tick*/, std::span<double> values) const { Values(values); }

 protected:
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace evalbus::metrics
