// Values of the option `contacts` of a run, which selects where contacts come from.
#pragma once

namespace evalbus::contacts_from {

// The collision checker computes contacts from the shapes of the geoms.
inline constexpr char kShapes[] = "shapes";
// The source publishes its own contacts (`evalbus watch --contacts source`).
inline constexpr char kSource[] = "source";

}  // namespace evalbus::contacts_from
