// Measures how long a process has been waiting. Pure: the caller supplies the times.
#pragma once

#include <algorithm>
#include <chrono>

namespace evalbus {

// Time in which the waiting process itself did not run (stopped, frozen, machine suspended) does not count,
// because the awaited process may not have run either.
class Wait {
 public:
  using Time = std::chrono::steady_clock::time_point;
  // A waiting process calls Elapsed() at least every 100 ms (Component::Poll). If the interval between two
  // calls exceeds kLongestLook, it counts as kLongestLook.
  static constexpr std::chrono::milliseconds kLongestLook{250};

  explicit Wait(Time now) : last_look_(now) {}

  // Returns the total waiting time so far. If calls are further apart than kLongestLook, time is missing.
  Time::duration Elapsed(Time now) {
    waited_ += std::clamp<Time::duration>(now - last_look_, Time::duration::zero(), kLongestLook);
    last_look_ = std::max(last_look_, now);
    return waited_;
  }

 private:
  Time last_look_;
  Time::duration waited_{};
};

}  // namespace evalbus
