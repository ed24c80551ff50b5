// Reassembles messages from their fragments, as liblcm does. A sender sends one message at a time, so an
// unfinished message is discarded when a fragment of the sender's next message arrives. Without its first
// fragment, a message is lost. Unlike in liblcm, duplicated fragments count once, and fragments that overlap
// or leave a gap do not form a message. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "bus/udpm/lcm_wire.h"

namespace evalbus {

class Reassembler {
 public:
  // Limits of the memory for all senders and of their number. If one would be exceeded, the senders that have
  // been silent longest are dropped.
  static constexpr size_t kMaxBytes = 2 * kMaxMessageBytes;
  static constexpr size_t kMaxSenders = 64;

  // Adds a fragment. sender: address and port of the sender. Returns the message that this fragment
  // completes, if any; its views are valid until the next call.
  std::optional<LcmMessage> Add(uint64_t sender, const LcmFragment& fragment);

  // Returns the number of begun messages that were discarded, because fragments are missing or inconsistent,
  // or to make room. A message whose first fragment is missing is not counted.
  int64_t lost() const { return lost_; }

 private:
  struct Part {
    uint32_t offset, size;
    friend bool operator==(const Part&, const Part&) = default;
  };
  struct Assembly {
    bool begun = false;
    uint32_t sequence = 0, message_bytes = 0;
    uint16_t count = 0;
    std::string channel;
    // Buffer that is reused for the sender's next message. Memory that no fragment has filled is not touched.
    std::unique_ptr<uint8_t[]> bytes;
    size_t capacity = 0;
    // Parts by fragment number.
    std::map<uint16_t, Part> parts;
    uint64_t received_at = 0;
  };

  void Begin(const LcmFragment& fragment, Assembly* assembly);
  // Drops senders until there is room for `bytes` more.
  void MakeRoom(uint64_t for_sender, size_t bytes);
  static bool IsWithoutGap(const Assembly& assembly);

  std::map<uint64_t, Assembly> by_sender_;
  uint64_t clock_ = 0;
  int64_t lost_ = 0;
};

}  // namespace evalbus
