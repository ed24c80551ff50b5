// Creates valid datagrams of LCM senders, and invalid ones.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bus/udpm/lcm_wire.h"

namespace evalbus {

inline std::string BigEndian(uint32_t number, int bytes) {
  std::string text;
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) text += static_cast<char>(number >> shift);
  return text;
}

inline std::string MessageDatagram(uint32_t sequence, std::string_view channel, std::string_view data) {
  return BigEndian(kMessageMagic, 4) + BigEndian(sequence, 4) + std::string(channel) + '\0' +
         std::string(data);
}

inline std::string FragmentDatagram(uint32_t sequence, uint32_t message_bytes, uint32_t offset,
                                    uint16_t number, uint16_t count, std::string_view payload) {
  return BigEndian(kFragmentMagic, 4) + BigEndian(sequence, 4) + BigEndian(message_bytes, 4) +
         BigEndian(offset, 4) + BigEndian(number, 2) + BigEndian(count, 2) + std::string(payload);
}

// Returns a message in fragments of this many bytes. The first fragment also has the channel's name.
inline std::vector<std::string> Fragments(uint32_t sequence, std::string_view channel, std::string_view data,
                                          size_t part_bytes) {
  const std::string all = std::string(channel) + '\0' + std::string(data);
  const size_t count = (all.size() + part_bytes - 1) / part_bytes;
  std::vector<std::string> fragments;
  for (size_t i = 0; i < count; ++i) {
    const size_t begin = i * part_bytes, offset = i == 0 ? 0 : begin - channel.size() - 1;
    fragments.push_back(FragmentDatagram(sequence, static_cast<uint32_t>(data.size()),
                                         static_cast<uint32_t>(offset), static_cast<uint16_t>(i),
                                         static_cast<uint16_t>(count), all.substr(begin, part_bytes)));
  }
  return fragments;
}

inline std::span<const uint8_t> AsBytes(std::string_view text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

}  // namespace evalbus
