// Ticks by the wall clock, and how well they kept to it. Pure: times are the caller's.
#pragma once

#include <chrono>
#include <cstdint>

#include "sim/durations.h"

namespace evalbus::sim {

class Pacer {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // Begins an episode whose tick 0 is published now. period: of a tick, wall-clock seconds.
  void Start(Time now, double period_s);

  // When the next tick is due.
  Time due() const { return due_; }
  // The tick that was due is out. One that is a whole period late moves all that follow, rather than a burst
  // of ticks nobody can answer in time.
  void Published(Time now);

  // Ticks that were a whole period late.
  int64_t late_ticks() const { return late_ticks_; }

  // Of each tick after tick 0, how long after its due time it went out.
  time_distribution_t Error() const { return error_.Distribution(); }

 private:
  Time::duration period_{};
  Time due_{};
  int64_t late_ticks_ = 0;
  Durations error_;
};

}  // namespace evalbus::sim
