// Converts bytes from and to the notation of the specification's vectors.
#pragma once

#include <string>
#include <string_view>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

inline Bytes FromHex(std::string_view hex) {
  Bytes bytes;
  for (size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<uint8_t>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
  }
  return bytes;
}

inline std::string ToHex(const Bytes& bytes) {
  std::string hex;
  for (const uint8_t byte : bytes) {
    for (const int digit : {byte >> 4, byte & 15}) hex += "0123456789abcdef"[digit];
  }
  return hex;
}

}  // namespace evalbus::policy
