// Decides when an event that recurs after an interruption counts as a new event. Defined by evalbus
// (docs/metrics.md).
#pragma once

#include <cstdint>

#include "lcmtypes/clock.h"

namespace evalbus::metrics {

// An interruption shorter than this (s) does not separate two events, because the contact only flickers.
inline constexpr double kSeparationTime = 0.1;

// Returns whether the interruption between two ticks lasts at least kSeparationTime. The condition held at
// `tick` and at `next_tick`, but at no tick between them. dt: time between ticks (s).
inline bool Separated(int64_t tick, int64_t next_tick, double dt) {
  return TickTime(next_tick - tick - 1, dt) >= kSeparationTime;
}

}  // namespace evalbus::metrics
