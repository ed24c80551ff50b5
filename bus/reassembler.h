// Messages out of their fragments, as liblcm makes them: a sender sends one message after the other, so its
// next one ends what is unfinished of the last, and a message whose first fragment was lost is lost. Unlike
// liblcm, a fragment that comes again does not count twice, and parts that overlap or leave a gap make no
// message. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "bus/lcm_wire.h"
#include "bus/message.h"

namespace evalbus {

class Reassembler {
 public:
  // What is in the making takes no more than this, whoever sends what; those that have been silent longest
  // go.
  static constexpr size_t kMaxBytes = 2 * kMaxMessageBytes;
  static constexpr size_t kMaxSenders = 64;

  // sender: its address and port. The message that this fragment makes whole, if it does: views that hold
  // until the next call.
  std::optional<LcmMessage> Add(uint64_t sender, const LcmFragment& fragment);

  // Messages given up: a fragment was lost, or they do not fit together.
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
    // Kept for the sender's next message. Memory that no fragment has filled is not touched.
    std::unique_ptr<uint8_t[]> bytes;
    size_t capacity = 0;
    // By number.
    std::map<uint16_t, Part> parts;
    uint64_t heard_at = 0;
  };

  void Begin(const LcmFragment& fragment, Assembly* assembly);
  // Throws out senders until there is room for one more of so many bytes.
  void MakeRoom(uint64_t for_sender, size_t bytes);
  static bool IsWithoutGap(const Assembly& assembly);

  std::map<uint64_t, Assembly> by_sender_;
  uint64_t clock_ = 0;
  int64_t lost_ = 0;
};

}  // namespace evalbus
