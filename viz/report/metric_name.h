// Names of metrics for people. Reads the unit from the end of a name ("_mps", "_rad"), as all of evalbus' own
// names carry it, so that a metric that is added shows up without a line here.
#pragma once

#include <string>

namespace evalbus::viz {

struct MetricName {
  std::string label;  // "cartesian path length, left"
  std::string unit;   // "m/s³"; empty for counts and shares
};

// Of a name as in summary.json: "extended.peak_wrist_speed_mps.left".
MetricName NameForPeople(const std::string& metric);

}  // namespace evalbus::viz
