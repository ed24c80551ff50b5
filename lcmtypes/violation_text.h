// A violation of a force limit as text for users.
#pragma once

#include <fmt/format.h>

#include <string>

#include "evalbus/limit_violation_t.hpp"

namespace evalbus {

// Returns, for example, "counter: 310 N by left/link7 on counter/counter, transient limit 200 N".
inline std::string ViolationText(const limit_violation_t& violation) {
  return fmt::format("{}: {:.0f} N by {} on {}, {} limit {:g} N", violation.region, violation.force_N,
                     violation.robot_body, violation.body,
                     violation.limit == "quasi_static" ? "quasi-static" : violation.limit, violation.limit_N);
}

}  // namespace evalbus
