// Progress of recording videos, for people.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <utility>

namespace evalbus::launch {

class VideoProgress {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // total: how many episodes are to be recorded as video; done: how many are at this time, also parts of one.
  VideoProgress(size_t total, double done, Time now, std::string verb = "recording video of")
      : total_(static_cast<double>(total)), first_(done), began_(now), verb_(std::move(verb)) {}

  // "recording video of 3 episodes: 45 %, 12 s left".
  std::string Text(double done, Time now) const;

 private:
  double total_, first_;
  Time began_;
  std::string verb_;
};

}  // namespace evalbus::launch
