// All extended metrics of one episode. Pure.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "evalbus/extended_metrics_t.hpp"
#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

class ExtendedMetrics {
 public:
  // Every registered metric, sorted by name.
  explicit ExtendedMetrics(const MetricsConfig& config);

  void Start();
  // `in_a_row` as in DerivedSample.
  void Add(const Sample& sample, const RobotContacts& contacts, bool in_a_row);

  // Fill in name, unit and value_mixed; no allocation when *extended was filled by the same object before.
  void Values(extended_metrics_t* extended) const;
  void FinalValues(extended_metrics_t* extended) const;

 private:
  void SetNames(extended_metrics_t* extended) const;

  struct Entry {
    std::vector<ValueName> names;
    std::unique_ptr<ExtendedMetric> metric;
  };
  double dt_;
  std::vector<Entry> entries_;
  // Of all values, in their order.
  std::vector<std::string> names_;
  std::vector<std::string> units_;
  std::vector<std::array<double, 3>> last_wrist_;
  std::vector<double> wrist_speed_;
};

}  // namespace evalbus::metrics
