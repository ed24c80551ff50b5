// Counted things in words.
#pragma once

#include <cstdint>
#include <string>

namespace evalbus {

// "1 episode", "3 episodes".
inline std::string Plural(int64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace evalbus
