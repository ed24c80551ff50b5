// Values of extended_metrics_t by name.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "evalbus/extended_metrics_t.hpp"

namespace evalbus {

// NaN where there is none.
inline double ExtendedValue(const extended_metrics_t& extended, const std::string& name) {
  for (size_t k = 0; k < extended.name.size(); ++k) {
    if (extended.name[k] == name) return extended.value_mixed[k];
  }
  return std::numeric_limits<double>::quiet_NaN();
}

// Of a metric that has a value for each arm: "<name>.<arm>" in their order, or "<name>" of the only one.
inline std::vector<double> ExtendedValues(const extended_metrics_t& extended, const std::string& name) {
  std::vector<double> values;
  for (size_t k = 0; k < extended.name.size(); ++k) {
    if (extended.name[k] == name || extended.name[k].starts_with(name + ".")) {
      values.push_back(extended.value_mixed[k]);
    }
  }
  return values;
}

}  // namespace evalbus
