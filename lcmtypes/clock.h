// What drives a run's clock, and how long a control tick is.
#pragma once

#include "evalbus/model_info_t.hpp"

namespace evalbus {

// Values of model_info_t.clock, which LCM's language cannot name.
namespace clock_name {
inline constexpr char kLockstep[] = "lockstep";  // each tick waits for its answers
inline constexpr char kRealtime[] = "realtime";  // the wall clock
}  // namespace clock_name

// Simulated time between two ticks, s.
inline double ControlPeriod(const model_info_t& model) {
  return static_cast<double>(model.timestep_us * model.substeps) / 1e6;
}

}  // namespace evalbus
