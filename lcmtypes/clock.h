// The clock of a run, and the duration of a control tick.
#pragma once

#include <algorithm>
#include <cmath>

#include "evalbus/model_info_t.hpp"

namespace evalbus {

// Values of model_info_t.clock. They are defined here because LCM's language has no string constants.
namespace clock_name {
inline constexpr char kLockstep[] = "lockstep";  // each tick waits for its answers
inline constexpr char kRealtime[] = "realtime";  // the wall clock
inline constexpr char kSource[] = "source";      // samples of a source or a file; nothing is simulated
}  // namespace clock_name

// Returns the simulated time between two ticks, in whole microseconds.
inline int64_t ControlPeriodUs(const model_info_t& model) { return model.timestep_us * model.substeps; }

// Converts simulated microseconds to seconds. Conversions for results use this function, so that equal ticks
// result in equal numbers.
inline double Seconds(int64_t us) { return static_cast<double>(us) / 1e6; }

// Returns the time of a tick if each tick lasts dt (s). Only the sum is rounded to a microsecond, so errors
// do not add up.
inline int64_t TickUs(int64_t ticks, double dt) {
  return std::llround(static_cast<double>(ticks) * dt * 1e6);
}
inline double TickTime(int64_t ticks, double dt) { return Seconds(TickUs(ticks, dt)); }

// Returns the rate of a source whose ticks are tick_us, rounded to a microsecond. Of all rates with this
// rounded tick, it is the rate with the fewest decimals: 30 Hz for 33333 us (not 30.0003 Hz), 59.94 Hz for
// 16683 us. Unlike in a simulation, the tick need not be a multiple of a physics step, so the rate can be
// exact.
inline double SourceHz(int64_t tick_us) {
  const double hz = 1e6 / static_cast<double>(tick_us);
  for (double scale = 1; scale < 1e6; scale *= 10) {
    const double rounded = std::round(hz * scale) / scale;
    if (rounded > 0 && std::llround(1e6 / rounded) == tick_us) return rounded;
  }
  return hz;
}

// Seconds between two ticks.
inline double ControlPeriod(const model_info_t& model) {
  const int64_t period_us = ControlPeriodUs(model);
  return model.clock == clock_name::kSource ? 1 / SourceHz(period_us) : Seconds(period_us);
}

// Returns whether the time that an episode continues after its first success (model.after_success_us) has
// passed by now_us. The tolerance of 1 us is for times of a source, which are rounded to a microsecond.
inline bool HasHeld(const model_info_t& model, int64_t success_us, int64_t now_us) {
  return now_us + 1 >= success_us + model.after_success_us;
}

// Returns the number of physics steps per control tick for a rate. It is rounded half to even, as in RoboEval
// (200 Hz: 2 steps of 2 ms).
inline int Substeps(double control_hz, int64_t timestep_us) {
  const double steps = std::nearbyint(1e6 / (control_hz * static_cast<double>(timestep_us)));
  return static_cast<int>(std::max(1.0, steps));
}

// Returns the control rate that results from the rounded number of physics steps.
inline double RealControlHz(double control_hz, int64_t timestep_us) {
  return 1e6 / static_cast<double>(Substeps(control_hz, timestep_us) * timestep_us);
}

}  // namespace evalbus
