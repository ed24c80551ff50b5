// Formats counts with nouns.
#pragma once

#include <cstdint>
#include <string>

namespace evalbus {

// Returns "1 episode" or "3 episodes".
inline std::string Plural(int64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace evalbus
