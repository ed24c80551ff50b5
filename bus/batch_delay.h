// How long who is in no hurry leaves messages of an episode where they are (Bus::SetMaxBatchDelay). Pure.
#pragma once

#include <algorithm>
#include <chrono>

namespace evalbus {

class BatchDelay {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::milliseconds kLongest{3};

  void Begin(Time now) { began_ = now; }

  // Next to nothing at an episode's begin, so that a short one hardly waits for us at its end.
  Time::duration At(Time now) const { return std::min<Time::duration>(kLongest, (now - began_) / 16); }

 private:
  Time began_{};
};

}  // namespace evalbus
