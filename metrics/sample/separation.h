// When something that stopped and comes again is a new event. Ours (docs/metrics.md).
#pragma once

#include <cstdint>

#include "lcmtypes/clock.h"

namespace evalbus::metrics {

// Shorter interruptions of a contact are a flicker, s.
inline constexpr double kSeparationTime = 0.1;

// Whether the samples between two ticks at which something was so last at least kSeparationTime.
inline bool Separated(int64_t tick, int64_t next_tick, double dt) {
  return TickTime(next_tick - tick - 1, dt) >= kSeparationTime;
}

}  // namespace evalbus::metrics
