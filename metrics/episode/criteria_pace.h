// When CRITERIA is said: after an episode's first tick, the tick of the verdict, and others at least 50 ms of
// simulated time apart; whoever says it adds the last tick.
#pragma once

#include <cstdint>
#include <optional>

#include "evalbus/header_t.hpp"

namespace evalbus::metrics {

class CriteriaPace {
 public:
  void Start() {
    said_.reset();
    verdict_ = 0;
  }
  // Ticks in order; verdict as in partial_metrics_t.
  bool IsDue(const header_t& header, int8_t verdict) {
    const bool is_due =
        !said_ || verdict != verdict_ || header.sim_time_us >= said_->sim_time_us + kPeriod_us;
    if (is_due) said_ = header;
    verdict_ = verdict;
    return is_due;
  }
  // It was said after this tick.
  bool IsSaid(const header_t& header) const { return said_ && said_->tick == header.tick; }

 private:
  static constexpr int64_t kPeriod_us = 50'000;
  std::optional<header_t> said_;
  int8_t verdict_ = 0;
};

}  // namespace evalbus::metrics
