// What is said again every so often of wall time, until it is heard or nobody needs it any more.
#pragma once

#include <chrono>

namespace evalbus {

class Repeater {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Repeater(Clock::duration period) : period_(period) {}

  // It was said just now.
  void Said(Clock::time_point now) { last_ = now; }
  bool Due(Clock::time_point now) const { return now - last_ >= period_; }

 private:
  Clock::duration period_;
  Clock::time_point last_{};
};

}  // namespace evalbus
