// All extended metrics of one episode. Pure.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

class ExtendedMetrics {
 public:
  // Contains no metrics if config.extended is false.
  explicit ExtendedMetrics(const MetricsConfig& config);

  void Start();
  void Add(const DerivedSample& sample);

  // names(), units() and Values() list the metrics in the same order, which is the order of
  // extended_metrics_t.
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<std::string>& units() const { return units_; }
  // Neither call allocates if *values has been filled before. FinalValues() also computes the values that are
  // too expensive to compute at every tick; last_tick is the episode's last tick.
  void Values(std::vector<double>* values) const;
  void FinalValues(int64_t last_tick, std::vector<double>* values) const;

 private:
  struct Entry {
    std::unique_ptr<ExtendedMetric> metric;
    size_t first, count;  // range of its values among all values
  };
  std::vector<Entry> entries_;
  std::vector<std::string> names_;
  std::vector<std::string> units_;
};

}  // namespace evalbus::metrics
