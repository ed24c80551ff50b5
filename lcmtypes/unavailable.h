// Values that a source does not provide (docs/metrics.md, "What a source must know"). In messages, such a
// number is NaN, such a count is kUnavailableCount, and the lists of extended_metrics_t do not contain the
// value. In JSON, its key is absent.
#pragma once

#include <cstdint>

namespace evalbus {

inline constexpr int64_t kUnavailableCount = -1;

}  // namespace evalbus
