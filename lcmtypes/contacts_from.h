// Values of the option `contacts` of a run, which selects where contacts come from.
#pragma once

#include <string>

#include "base/errors.h"

namespace evalbus::contacts_from {

// The collision checker computes contacts from the shapes of the geoms.
inline constexpr char kShapes[] = "shapes";
// The source publishes its own contacts (`evalbus watch --contacts source`).
inline constexpr char kSource[] = "source";

// Throws InputError if the value is none of these.
inline void Check(const std::string& contacts) {
  if (contacts == kShapes || contacts == kSource) return;
  throw InputError("--contacts: expected shapes or source, got '" + contacts + "'");
}

}  // namespace evalbus::contacts_from
