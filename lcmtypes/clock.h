// What drives a run's clock, and how long a control tick is.
#pragma once

#include <algorithm>
#include <cmath>

#include "evalbus/model_info_t.hpp"

namespace evalbus {

// Values of model_info_t.clock, which LCM's language cannot name.
namespace clock_name {
inline constexpr char kLockstep[] = "lockstep";  // each tick waits for its answers
inline constexpr char kRealtime[] = "realtime";  // the wall clock
}  // namespace clock_name

// Simulated time between two ticks.
inline int64_t ControlPeriodUs(const model_info_t& model) { return model.timestep_us * model.substeps; }

// Simulated seconds: whoever turns a time into seconds gets the same number for the same tick.
inline double Seconds(int64_t us) { return static_cast<double>(us) / 1e6; }

// Of so many ticks that last dt (s) each.
inline double TickTime(int64_t ticks, double dt) {
  return Seconds(std::llround(static_cast<double>(ticks) * dt * 1e6));
}

inline double ControlPeriod(const model_info_t& model) { return Seconds(ControlPeriodUs(model)); }

// Physics steps per control tick for a rate: rounded half to even, as RoboEval does (200 Hz: 2 of 2 ms).
inline int Substeps(double control_hz, int64_t timestep_us) {
  const double steps = std::nearbyint(1e6 / (control_hz * static_cast<double>(timestep_us)));
  return static_cast<int>(std::max(1.0, steps));
}

// The rate that comes of it.
inline double RealControlHz(double control_hz, int64_t timestep_us) {
  return 1e6 / static_cast<double>(Substeps(control_hz, timestep_us) * timestep_us);
}

}  // namespace evalbus
