// Why an episode ended, as in episode_end_t and episode_summary_t (LCM has no constants that are strings).
#pragma once

#include <cstdint>

#include "evalbus/partial_metrics_t.hpp"

namespace evalbus::end_reason {

// The verdict of metrics.
inline constexpr char kSuccess[] = "success";
inline constexpr char kFailure[] = "failure";
// The sim's own ends.
inline constexpr char kTimeLimit[] = "time_limit";
inline constexpr char kUnstable[] = "unstable";
inline constexpr char kPolicyError[] = "policy_error";
inline constexpr char kPolicyTimeout[] = "policy_timeout";
inline constexpr char kAborted[] = "aborted";

}  // namespace evalbus::end_reason

namespace evalbus {

// What a verdict (partial_metrics_t) ends an episode with; empty while it is undecided.
inline const char* ReasonOf(int8_t verdict) {
  return verdict == partial_metrics_t::SUCCESS   ? end_reason::kSuccess
         : verdict == partial_metrics_t::FAILURE ? end_reason::kFailure
                                                 : "";
}

}  // namespace evalbus
