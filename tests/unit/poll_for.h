#pragma once

#include <chrono>

#include "bus/bus.h"

namespace evalbus {

// Polls the component as its host does, for the given duration. Returns the time at the end.
template <class Polled>
SteadyTime PollFor(Polled* polled, SteadyTime from, SteadyTime::duration time) {
  SteadyTime now = from;
  for (; now <= from + time; now += std::chrono::milliseconds(100)) polled->Poll(now);
  return now;
}

}  // namespace evalbus
