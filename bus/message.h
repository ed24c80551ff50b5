// Messages as bytes: to send, to compare, to look at without decoding all of them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "evalbus/header_t.hpp"

namespace evalbus {

// A larger message is damage, or not ours. MODEL has some 20 KB, a lossless image some MB.
inline constexpr size_t kMaxMessageBytes = size_t{64} << 20;

// Into the storage of `bytes`.
template <class Message>
void Encode(const Message& message, std::vector<uint8_t>* bytes) {
  bytes->resize(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes->data(), 0, static_cast<int>(bytes->size()));
}
template <class Message>
std::vector<uint8_t> Encode(const Message& message) {
  std::vector<uint8_t> bytes;
  Encode(message, &bytes);
  return bytes;
}

// True if all of data is one message of this type. Whatever the bytes are, decoding allocates in proportion
// to their number (cmake/bounded_counts.sed).
template <class Message>
bool Decode(std::span<const uint8_t> data, Message* message) {
  return message->decode(data.data(), 0, static_cast<int>(data.size())) == static_cast<int>(data.size());
}

// What a message of that type begins with; 0 for what is too short to be any.
inline int64_t Fingerprint(std::span<const uint8_t> data) {
  int64_t fingerprint = 0;
  return __int64_t_decode_array(data.data(), 0, static_cast<int>(data.size()), &fingerprint, 1) > 0
             ? fingerprint
             : 0;
}

// Messages that begin, after the fingerprint, with the session of their publisher.
template <class Message>
concept HasSession = requires(Message message) {
  message.session;
}
|| requires(Message message) { message.header.session; };

// Position and size of the session in the bytes of such a message.
inline constexpr size_t kSessionBegin = sizeof(int64_t), kSessionEnd = kSessionBegin + sizeof(int64_t);

// Of the bytes of a message that HasSession. 0 where they are too few to be one.
inline int64_t SessionOf(std::span<const uint8_t> data) {
  int64_t session = 0;
  if (data.size() >= kSessionEnd) {
    __int64_t_decode_array(data.data(), kSessionBegin, static_cast<int>(data.size()) - kSessionBegin,
                           &session, 1);
  }
  return session;
}

inline void SetSession(int64_t session, std::span<uint8_t> data) {
  if (data.size() >= kSessionEnd) {
    __int64_t_encode_array(data.data(), kSessionBegin, static_cast<int>(data.size()) - kSessionBegin,
                           &session, 1);
  }
}

// The header of a message that begins with one, without decoding the rest; false if the bytes are of another
// type.
template <class Message>
bool DecodeHeader(std::span<const uint8_t> data, header_t* header) {
  constexpr int kBegin = sizeof(int64_t);
  return Fingerprint(data) == Message::getHash() &&
         header->_decodeNoHash(data.data(), kBegin, static_cast<int>(data.size()) - kBegin) > 0;
}

// True if the bytes differ from those known, which they then become: of messages that are repeated.
inline bool UpdateIfChanged(std::span<const uint8_t> data, std::vector<uint8_t>* known) {
  if (std::ranges::equal(data, *known)) return false;
  known->assign(data.begin(), data.end());
  return true;
}

// Ticks and times that no episode reaches (one of decades) are damage, or not ours; arithmetic with them
// overflows.
inline constexpr int64_t kMaxTick = int64_t{1} << 40;
inline constexpr int64_t kMaxSimTimeUs = int64_t{1} << 50;

inline bool IsPlausible(const header_t& header) {
  return header.tick >= 0 && header.tick <= kMaxTick && header.sim_time_us >= 0 &&
         header.sim_time_us <= kMaxSimTimeUs;
}

}  // namespace evalbus
