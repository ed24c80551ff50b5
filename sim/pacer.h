// Schedules ticks by the wall clock and measures their timing error. Pure: the caller supplies the times.
#pragma once

#include <chrono>
#include <cstdint>

#include "sim/durations.h"

namespace evalbus::sim {

class Pacer {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // Begins an episode whose tick 0 is published now. period_s: wall-clock time per tick.
  void Start(Time now, double period_s);

  // Due time of the next tick.
  Time due() const { return due_; }
  // Must be called when the due tick has been published. If the tick was late by a whole period or more, all
  // following ticks are postponed, which avoids a burst of ticks that no policy can answer in time.
  void Published(Time now);

  // Returns the number of ticks that were late by a whole period or more.
  int64_t late_ticks() const { return late_ticks_; }

  // Delay of each tick after tick 0, from its due time to its publication.
  time_distribution_t Error() const { return error_.Distribution(); }

 private:
  Time::duration period_{};
  Time due_{};
  int64_t late_ticks_ = 0;
  Durations error_;
};

}  // namespace evalbus::sim
