// Ticks and times that no episode reaches are damage, or not ours; arithmetic with them overflows.
#pragma once

#include <cstdint>

#include "evalbus/header_t.hpp"

namespace evalbus {

// An episode of decades.
inline constexpr int64_t kMaxTick = int64_t{1} << 40;
inline constexpr int64_t kMaxSimTimeUs = int64_t{1} << 50;

inline bool IsPlausible(const header_t& header) {
  return header.tick >= 0 && header.tick <= kMaxTick && header.sim_time_us >= 0 &&
         header.sim_time_us <= kMaxSimTimeUs;
}

}  // namespace evalbus
