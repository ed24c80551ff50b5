// When something that stopped and comes again is a new event. Ours (docs/metrics.md).
#pragma once

#include <cstdint>

namespace evalbus::metrics {

// Shorter interruptions of a contact are a flicker, s.
inline constexpr double kSeparationTime = 0.1;

// Whether the samples between two ticks at which something was so last at least kSeparationTime. Half a
// microsecond, the resolution of simulated time, is for the rounding of dt.
inline bool Separated(int64_t tick, int64_t next_tick, double dt) {
  return static_cast<double>(next_tick - tick - 1) * dt >= kSeparationTime - 5e-7;
}

}  // namespace evalbus::metrics
