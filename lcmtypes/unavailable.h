// Values that a source does not provide (docs/metrics.md, "What a source must know"). In messages, an
// unavailable number is NaN, an unavailable count is kUnavailableCount, and the lists of extended_metrics_t
// do not contain unavailable values. In JSON, the key of an unavailable value is absent.
#pragma once

#include <cstdint>

namespace evalbus {

inline constexpr int64_t kUnavailableCount = -1;

}  // namespace evalbus
