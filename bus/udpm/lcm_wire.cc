#include "bus/udpm/lcm_wire.h"

#include <algorithm>
#include <optional>

namespace evalbus {
namespace {

uint16_t BigEndian16(const uint8_t* at) { return static_cast<uint16_t>(at[0] << 8 | at[1]); }

// Removes the channel's name and its NUL from the beginning of `bytes`. Returns nullopt if they do not begin
// with a name.
std::optional<std::string_view> RemoveChannel(std::span<const uint8_t>* bytes) {
  const auto end = std::ranges::find(*bytes, uint8_t{0});
  const auto size = static_cast<size_t>(end - bytes->begin());
  if (end == bytes->end() || size > kMaxChannelBytes) return std::nullopt;
  const std::string_view channel(reinterpret_cast<const char*>(bytes->data()), size);
  *bytes = bytes->subspan(size + 1);
  return channel;
}

}  // namespace

std::variant<std::monostate, LcmMessage, LcmFragment> ParseDatagram(std::span<const uint8_t> datagram) {
  if (datagram.size() < kMessageHeaderBytes) return {};
  const uint8_t* bytes = datagram.data();
  if (BigEndian32(bytes) == kMessageMagic) {
    LcmMessage message{.channel = {}, .data = datagram.subspan(kMessageHeaderBytes)};
    const auto channel = RemoveChannel(&message.data);
    if (!channel) return {};
    message.channel = *channel;
    return message;
  }
  if (BigEndian32(bytes) != kFragmentMagic || datagram.size() < kFragmentHeaderBytes) return {};
  LcmFragment fragment{.sequence = BigEndian32(bytes + 4),
                       .message_bytes = BigEndian32(bytes + 8),
                       .offset = BigEndian32(bytes + 12),
                       .number = BigEndian16(bytes + 16),
                       .count = BigEndian16(bytes + 18),
                       .channel = {},
                       .data = datagram.subspan(kFragmentHeaderBytes)};
  if (fragment.number == 0) {
    const auto channel = RemoveChannel(&fragment.data);
    if (!channel) return {};
    fragment.channel = *channel;
  }
  const uint64_t end = uint64_t{fragment.offset} + fragment.data.size();
  if (fragment.message_bytes > kMaxMessageBytes || end > fragment.message_bytes ||
      fragment.number >= fragment.count) {
    return {};
  }
  return fragment;
}

}  // namespace evalbus
