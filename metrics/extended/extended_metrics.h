// All extended metrics of one episode. Pure.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

class ExtendedMetrics {
 public:
  // None where the config says so.
  explicit ExtendedMetrics(const MetricsConfig& config);

  void Start();
  void Add(const DerivedSample& sample);

  // As in extended_metrics_t: name, unit and value of each, in one order.
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<std::string>& units() const { return units_; }
  // No allocation where *values was filled before. The final ones, of an episode with this last tick, include
  // what is too dear to be evaluated at every tick.
  void Values(std::vector<double>* values) const;
  void FinalValues(int64_t last_tick, std::vector<double>* values) const;

 private:
  struct Entry {
    std::unique_ptr<ExtendedMetric> metric;
    size_t first, count;  // its values among all
  };
  std::vector<Entry> entries_;
  std::vector<std::string> names_;
  std::vector<std::string> units_;
};

}  // namespace evalbus::metrics
