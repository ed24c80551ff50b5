// Timer for messages that are repeated with a wall-clock period until they are received or no longer needed.
#pragma once

#include <chrono>

namespace evalbus {

class Repeater {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Repeater(Clock::duration period) : period_(period) {}

  // Records that the message was published now.
  void MarkSent(Clock::time_point now) { last_ = now; }
  bool Due(Clock::time_point now) const { return now - last_ >= period_; }

 private:
  Clock::duration period_;
  Clock::time_point last_{};
};

}  // namespace evalbus
