// What a metric of ours, beside RoboEval's, looks like. Each is a class in a header of its own in
// metrics/extended/, registered there, and a line in extended_metrics.cc that includes it; message, JSON,
// statistics and monitor take its values from there. Definitions: docs/metrics.md.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "metrics/metrics_config.h"
#include "metrics/robot_contacts.h"
#include "metrics/sample.h"

namespace evalbus::metrics {

struct ValueName {
  // Ends in the unit ("min_clearance_m"), counts and plain numbers excepted.
  std::string name;
  // As in extended_metrics_t: "count" for whole numbers, "1" for what has none.
  std::string unit;
};

// One value for each name, "<name>.<who>"; for a single one just the name.
inline std::vector<ValueName> NameEach(const ValueName& value, const std::vector<std::string>& who) {
  if (who.size() == 1) return {value};
  std::vector<ValueName> names;
  for (const std::string& one : who) names.push_back({value.name + "." + one, value.unit});
  return names;
}

inline std::vector<ValueName> NameEachArm(const ValueName& value, const MetricsConfig& config) {
  std::vector<std::string> arms;
  for (const ArmConfig& arm : config.arms) arms.push_back(arm.name);
  return NameEach(value, arms);
}

// A sample, and what more than one metric derives from it.
struct DerivedSample {
  const Sample& sample;
  // The tick before was a sample too; false for the first one and after a hole.
  bool in_a_row;
  // By arm, norm(p_i - p_(i-1)) / dt, m/s; 0 where not in_a_row.
  std::span<const double> wrist_speed;
  const RobotContacts& contacts;
};

class ExtendedMetric {
 public:
  virtual ~ExtendedMetric() = default;
  // Begins an episode; nothing of the one before remains.
  virtual void Start() = 0;
  // One sample; no allocation.
  virtual void Add(const DerivedSample& sample) = 0;
  // The values so far, in the order of their names; NaN where there is none. No allocation.
  virtual void Values(std::span<double> values) const = 0;
  // At the end of the episode: also what is too dear to be evaluated at every tick.
  virtual void FinalValues(std::span<double> values) const { Values(values); }
};

// What there is to know of a metric before it is made.
struct ExtendedMetricType {
  std::vector<ValueName> (*names)(const MetricsConfig& config);
  std::unique_ptr<ExtendedMetric> (*make)(const MetricsConfig& config);
};

// Every registered metric. Includes the headers of all.
std::vector<ExtendedMetricType>& ExtendedMetricTypes();

// For a class with a constructor from MetricsConfig and a static Names(const MetricsConfig&).
template <typename Metric>
bool RegisterExtendedMetric() {
  ExtendedMetricTypes().push_back(
      {.names = Metric::Names, .make = [](const MetricsConfig& config) -> std::unique_ptr<ExtendedMetric> {
         return std::make_unique<Metric>(config);
       }});
  return true;
}

}  // namespace evalbus::metrics
