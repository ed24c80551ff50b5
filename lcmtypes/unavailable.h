// Values that a source does not know (docs/metrics.md, "What a source must know"): in messages a number is
// NaN, a count this, and a value of extended_metrics_t is not in its lists; in JSON all of these keys are
// absent.
#pragma once

#include <cstdint>

namespace evalbus {

inline constexpr int64_t kUnavailableCount = -1;

}  // namespace evalbus
