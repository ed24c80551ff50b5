// How long a control tick is.
#pragma once

#include "evalbus/model_info_t.hpp"

namespace evalbus {

// Simulated time between two ticks, s.
inline double ControlPeriod(const model_info_t& model) {
  return static_cast<double>(model.timestep_us * model.substeps) / 1e6;
}

}  // namespace evalbus
