// A block of docs/viewer_data.md that is JSON alone, of a head that is text already.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>

namespace evalbus::viz {

inline std::string JsonBlock(const std::string& head) {
  constexpr size_t kAlignment = 8;
  const auto length = static_cast<uint32_t>(head.size());
  std::string bytes(sizeof length, '\0');
  std::memcpy(bytes.data(), &length, sizeof length);
  bytes += head;
  bytes.resize((bytes.size() + kAlignment - 1) / kAlignment * kAlignment, '\0');
  return bytes;
}

}  // namespace evalbus::viz
