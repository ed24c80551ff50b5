// LCM's multicast wire format (lcm/lcm_udpm.c): the contents of one datagram. All numbers are big-endian.
//
//     message:   "LC02"  sequence u32  channel NUL  data
//     fragment:  "LC03"  sequence u32  size of the message's data u32  offset of this fragment in it u32
//                fragment number u16  number of fragments u16  bytes; in fragment 0, channel NUL comes first
//
// Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <variant>

namespace evalbus {

inline constexpr uint32_t kMessageMagic = 0x4c433032, kFragmentMagic = 0x4c433033;
inline constexpr size_t kMessageHeaderBytes = 8, kFragmentHeaderBytes = 20;
inline constexpr size_t kMaxDatagramBytes = 65507;
// Larger messages are treated as damaged or foreign. A MODEL has about 20 KB, a lossless image several MB.
inline constexpr size_t kMaxMessageBytes = size_t{64} << 20;
// Maximum length of a channel's name, without its NUL.
inline constexpr size_t kMaxChannelBytes = 63;

inline uint32_t BigEndian32(const uint8_t* at) {
  return uint32_t{at[0]} << 24 | uint32_t{at[1]} << 16 | uint32_t{at[2]} << 8 | uint32_t{at[3]};
}

// A message. Both members are views into the datagram or into reassembled bytes.
struct LcmMessage {
  std::string_view channel;
  std::span<const uint8_t> data;
};

struct LcmFragment {
  uint32_t sequence = 0;
  uint32_t message_bytes = 0;
  uint32_t offset = 0;
  uint16_t number = 0;
  uint16_t count = 0;
  // Set only in fragment 0.
  std::string_view channel;
  std::span<const uint8_t> data;
};

// monostate: the datagram is not LCM, its fields are inconsistent, or its message is larger than
// kMaxMessageBytes.
std::variant<std::monostate, LcmMessage, LcmFragment> ParseDatagram(std::span<const uint8_t> datagram);

}  // namespace evalbus
