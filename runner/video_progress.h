// Formats the progress of recording videos, with an estimate of the remaining time.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <utility>

namespace evalbus::runner {

class VideoProgress {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // total: number of episodes to record. done: number of episodes recorded at time `now`, including
  // fractions.
  VideoProgress(size_t total, double done, Time now, std::string verb = "recording video of")
      : total_(static_cast<double>(total)), first_(done), began_(now), verb_(std::move(verb)) {}

  // Returns, for example, "recording video of 3 episodes: 45 %, 12 s left".
  std::string Text(double done, Time now) const;

 private:
  double total_, first_;
  Time began_;
  std::string verb_;
};

}  // namespace evalbus::runner
