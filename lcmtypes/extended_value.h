// Looks up a value of extended_metrics_t by its name.
#pragma once

#include <limits>
#include <string>

#include "evalbus/extended_metrics_t.hpp"

namespace evalbus {

// Returns NaN if there is no value of this name.
inline double ExtendedValue(const extended_metrics_t& extended, const std::string& name) {
  for (size_t k = 0; k < extended.name.size(); ++k) {
    if (extended.name[k] == name) return extended.value_mixed[k];
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace evalbus
