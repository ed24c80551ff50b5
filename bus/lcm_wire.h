// LCM's multicast wire format (lcm/lcm_udpm.c): what one datagram carries. All numbers are big-endian.
//
//   a message:    "LC02"  sequence u32  channel NUL  data
//   part of one:  "LC03"  sequence u32  size of the whole data u32  where in it this part belongs u32
//                 number of this part u16  how many there are u16  part; that of number 0 begins with channel
//                 NUL
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
// Of a channel's name, without its NUL.
inline constexpr size_t kMaxChannelBytes = 63;

inline uint32_t BigEndian32(const uint8_t* at) {
  return uint32_t{at[0]} << 24 | uint32_t{at[1]} << 16 | uint32_t{at[2]} << 8 | uint32_t{at[3]};
}

// Both are views.
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
  // Of number 0 alone.
  std::string_view channel;
  std::span<const uint8_t> data;
};

// monostate: it is no LCM datagram, or says what cannot be, or is of a message larger than kMaxMessageBytes.
std::variant<std::monostate, LcmMessage, LcmFragment> ParseDatagram(std::span<const uint8_t> datagram);

}  // namespace evalbus
