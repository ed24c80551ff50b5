// Encodes, decodes and compares messages as bytes, and reads single fields without decoding the whole
// message.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "bus/udpm/lcm_wire.h"
#include "evalbus/header_t.hpp"

namespace evalbus {

// Encodes into `bytes` and reuses its storage.
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

// Returns true if `data` is exactly one message of this type. For any input, decoding allocates at most
// memory in proportion to its size (cmake/bounded_counts.sed).
template <class Message>
bool Decode(std::span<const uint8_t> data, Message* message) {
  return message->decode(data.data(), 0, static_cast<int>(data.size())) == static_cast<int>(data.size());
}

// Returns the type fingerprint at the beginning of a message; 0 if the bytes are too few.
inline int64_t Fingerprint(std::span<const uint8_t> data) {
  int64_t fingerprint = 0;
  return __int64_t_decode_array(data.data(), 0, static_cast<int>(data.size()), &fingerprint, 1) > 0
             ? fingerprint
             : 0;
}

// Messages whose first field after the fingerprint is the session of their publisher.
template <class Message>
concept HasSession = requires(Message message) {
  message.session;
}
|| requires(Message message) { message.header.session; };

// Byte range of the session in such a message.
inline constexpr size_t kSessionBegin = sizeof(int64_t), kSessionEnd = kSessionBegin + sizeof(int64_t);

// Returns the session of a message that HasSession; 0 if the bytes are too few.
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

// Decodes the header at the beginning of a message, but not the rest. Returns false if the bytes are of
// another type.
template <class Message>
bool DecodeHeader(std::span<const uint8_t> data, header_t* header) {
  constexpr int kBegin = sizeof(int64_t);
  return Fingerprint(data) == Message::getHash() &&
         header->_decodeNoHash(data.data(), kBegin, static_cast<int>(data.size()) - kBegin) > 0;
}

// Detects repeated messages: returns true if `data` differs from `known`, and then stores it in `known`.
inline bool UpdateIfChanged(std::span<const uint8_t> data, std::vector<uint8_t>* known) {
  if (std::ranges::equal(data, *known)) return false;
  known->assign(data.begin(), data.end());
  return true;
}

// Larger ticks and times (decades) do not occur in an episode. Messages with them are treated as damaged or
// foreign, because arithmetic with such numbers could overflow.
inline constexpr int64_t kMaxTick = int64_t{1} << 40;
inline constexpr int64_t kMaxSimTimeUs = int64_t{1} << 50;

inline bool IsPlausible(const header_t& header) {
  return header.tick >= 0 && header.tick <= kMaxTick && header.sim_time_us >= 0 &&
         header.sim_time_us <= kMaxSimTimeUs;
}

}  // namespace evalbus
