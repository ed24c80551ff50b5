// Batch delay for components that may handle messages late (Bus::SetMaxBatchDelay). Pure.
#pragma once

#include <algorithm>
#include <chrono>

namespace evalbus {

class BatchDelay {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::milliseconds kLongest{3};

  void Begin(Time now) { began_ = now; }

  // Returns the delay. It is nearly zero at the beginning of an episode, so that the end of a short episode
  // is hardly delayed.
  Time::duration At(Time now) const { return std::min<Time::duration>(kLongest, (now - began_) / 16); }

 private:
  Time began_{};
};

}  // namespace evalbus
