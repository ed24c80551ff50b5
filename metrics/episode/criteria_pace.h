// Decides when CRITERIA is published: after an episode's first tick, at the tick of the verdict, and
// otherwise at least 50 ms of simulated time apart. The publisher adds the last tick.
#pragma once

#include <cstdint>
#include <optional>

#include "evalbus/header_t.hpp"

namespace evalbus::metrics {

class CriteriaPace {
 public:
  void Start() {
    published_.reset();
    verdict_ = 0;
  }
  // Must be called in tick order; verdict as in partial_metrics_t.
  bool IsDue(const header_t& header, int8_t verdict) {
    const bool is_due =
        !published_ || verdict != verdict_ || header.sim_time_us >= published_->sim_time_us + kPeriod_us;
    if (is_due) published_ = header;
    verdict_ = verdict;
    return is_due;
  }
  // Returns whether CRITERIA was published for this tick.
  bool IsPublished(const header_t& header) const { return published_ && published_->tick == header.tick; }

 private:
  static constexpr int64_t kPeriod_us = 50'000;
  std::optional<header_t> published_;
  int8_t verdict_ = 0;
};

}  // namespace evalbus::metrics
