// Values of messages and options that depend on the source of a run.
#pragma once

#include <cstdint>
#include <string>

#include "base/errors.h"

namespace evalbus {

// Values of model_info_t.source that evalbus defines. All other values are names of external sources.
namespace source_name {

inline constexpr char kSim[] = "sim";
inline constexpr char kFile[] = "file";

}  // namespace source_name

// Values of the option `contacts` of a run, which selects where contacts come from.
namespace contacts_from {

// The collision checker computes contacts from the shapes of the geoms.
inline constexpr char kShapes[] = "shapes";
// The source publishes its own contacts (`evalbus watch --contacts source`).
inline constexpr char kSource[] = "source";

// Throws InputError if the value is none of these.
inline void Check(const std::string& contacts) {
  if (contacts == kShapes || contacts == kSource) return;
  throw InputError("--contacts: expected shapes or source, got '" + contacts + "'");
}

}  // namespace contacts_from

// Value of a count that a source does not provide (docs/metrics.md, "What a source must know"). In messages,
// an unavailable number is NaN, and the lists of extended_metrics_t do not contain unavailable values. In
// JSON, the key of an unavailable value is absent.
inline constexpr int64_t kUnavailableCount = -1;

}  // namespace evalbus
