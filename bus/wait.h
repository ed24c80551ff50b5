// How long somebody has been waited for. Pure: times are the caller's.
#pragma once

#include <algorithm>
#include <chrono>

namespace evalbus {

// Time in which the waiting process itself did not run (stopped, frozen, on a machine that was suspended) is
// not waiting time: whoever it waits for may not have run either.
class Wait {
 public:
  using Time = std::chrono::steady_clock::time_point;
  // Who waits looks at least every 100 ms (bus/host.h). What lies between two looks counts for no more than
  // this.
  static constexpr std::chrono::milliseconds kLongestLook{250};

  // Begins now.
  explicit Wait(Time now) : last_look_(now) {}

  // To be asked again and again: how long it has lasted by now.
  Time::duration Look(Time now) {
    waited_ += std::clamp<Time::duration>(now - last_look_, Time::duration::zero(), kLongestLook);
    last_look_ = std::max(last_look_, now);
    return waited_;
  }

 private:
  Time last_look_;
  Time::duration waited_{};
};

}  // namespace evalbus
