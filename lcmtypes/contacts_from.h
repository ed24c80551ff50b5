// What decides contacts: option `contacts` of a run.
#pragma once

namespace evalbus::contacts_from {

// The collision checker.
inline constexpr char kShapes[] = "shapes";
// A source that publishes its own contacts (`evalbus watch --contacts source`).
inline constexpr char kSource[] = "source";

}  // namespace evalbus::contacts_from
