// Distribution of durations. Pure.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <vector>

#include "evalbus/time_distribution_t.hpp"

namespace evalbus::sim {

class Durations {
 public:
  void Clear() { seconds_.clear(); }
  void Add(std::chrono::steady_clock::duration time) {
    seconds_.push_back(std::chrono::duration<double>(time).count());
  }

  time_distribution_t Distribution() const {
    time_distribution_t distribution{};
    if (seconds_.empty()) return distribution;
    std::vector<double> sorted = seconds_;
    std::ranges::sort(sorted);
    const auto percentile = [&](double share) {
      return sorted[static_cast<size_t>(std::ceil(share * static_cast<double>(sorted.size()))) - 1];
    };
    distribution.count = static_cast<int64_t>(sorted.size());
    distribution.p50_s = percentile(0.50);
    distribution.p99_s = percentile(0.99);
    distribution.p999_s = percentile(0.999);
    distribution.max_s = sorted.back();
    return distribution;
  }

 private:
  std::vector<double> seconds_;
};

}  // namespace evalbus::sim
