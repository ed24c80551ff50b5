// Interprets the bytes of an input as messages on a bus: messages of a real episode, unchanged or modified,
// and arbitrary bytes.
//
// An input is a sequence of events. The first byte of each is channel + 64 * how:
//   how 0, 1  a real message of the channel; then its number, a count (modulo 8), and as many changes of four
//             bytes: kind, place (2), value
//   how 2     two bytes of length, and as many bytes after the channel's fingerprint
//   how 3     the same without the fingerprint
//
// For channel kWait the second byte is a waiting time in tenths of a second.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "bus/channels.h"
#include "bus/message.h"
#include "evalbus/action_t.hpp"
#include "evalbus/command_t.hpp"
#include "evalbus/component_status_t.hpp"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/run_summary_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus {

using Bytes = std::vector<uint8_t>;
// Messages by channel, in the order of an episode.
using Samples = std::map<std::string, std::vector<Bytes>>;

struct SpokenChannel {
  std::string name;
  int64_t fingerprint = 0;
};
// All channels except images.
inline std::vector<SpokenChannel> SpokenChannels() {
  std::vector<SpokenChannel> spoken;
  channels::ForEach([&]<class Message>(const Channel<Message>& channel) {
    if (channel != channels::kImage.name) spoken.push_back({channel.name, Message::getHash()});
  });
  return spoken;
}
inline constexpr uint8_t kWait = 63;

class Conversation {
 public:
  Conversation(std::span<const uint8_t> input, const Samples& samples) : input_(input), samples_(samples) {}

  // Calls say(channel, bytes) and wait(tenths of a second) until the input ends.
  template <class Say, class Wait>
  void Hold(const Say& say, const Wait& wait) {
    while (!input_.empty()) {
      const uint8_t first = Byte();
      if ((first & 63) == kWait) {
        wait(Byte());
      } else {
        const SpokenChannel& channel = channels_[(first & 63) % channels_.size()];
        say(channel.name, first < 128 ? Changed(channel) : AnyBytes(channel, first < 192));
      }
    }
  }

 private:
  uint8_t Byte() {
    if (input_.empty()) return 0;
    const uint8_t byte = input_[0];
    input_ = input_.subspan(1);
    return byte;
  }
  size_t TwoBytes() {
    const size_t high = Byte();
    return high << 8 | Byte();
  }

  Bytes AnyBytes(const SpokenChannel& channel, bool has_fingerprint) {
    Bytes message;
    for (int shift = 56; has_fingerprint && shift >= 0; shift -= 8) {
      message.push_back(static_cast<uint8_t>(channel.fingerprint >> shift));
    }
    size_t length = TwoBytes();
    length = std::min(length, input_.size());
    message.insert(message.end(), input_.begin(), input_.begin() + static_cast<std::ptrdiff_t>(length));
    input_ = input_.subspan(length);
    return message;
  }

  Bytes Changed(const SpokenChannel& channel) {
    const uint8_t number = Byte();
    const auto samples = samples_.find(channel.name);
    if (samples == samples_.end()) return {};
    Bytes message = samples->second[number % samples->second.size()];
    for (int changes = Byte() % 8; changes > 0; --changes) {
      const uint8_t kind = Byte();
      const size_t place = TwoBytes();
      const uint8_t value = Byte();
      if (!message.empty()) Change(kind, place % message.size(), value, &message);
    }
    return message;
  }

  static void Change(uint8_t kind, size_t place, uint8_t value, Bytes* message) {
    // These numbers provoke arithmetic errors. The last ones are doubles: -1, 1e308, infinity and NaN.
    constexpr uint64_t kNumbers[] = {0,
                                     1,
                                     100,
                                     4097,
                                     0x7FFFFFFF,
                                     0x80000000,
                                     0xFFFFFFFF,
                                     0x7FFFFFFFFFFFFFFF,
                                     0x8000000000000000,
                                     0xFFFFFFFFFFFFFFFF,
                                     0xBFF0000000000000,
                                     0x7FE1CCF385EBC8A0,
                                     0x7FF0000000000000,
                                     0x7FF8000000000000};
    const auto write = [&](size_t size) {
      const uint64_t number = kNumbers[value % std::size(kNumbers)];
      for (size_t i = 0; i < size && place + i < message->size(); ++i) {
        (*message)[place + i] = static_cast<uint8_t>(number >> 8 * (size - 1 - i));
      }
    };
    if (kind % 4 == 0) {
      (*message)[place] = value;
    } else if (kind % 4 == 1) {
      write(8);
    } else if (kind % 4 == 2) {
      write(4);
    } else {
      message->resize(place);
    }
  }

  std::span<const uint8_t> input_;
  const Samples& samples_;
  const std::vector<SpokenChannel> channels_ = SpokenChannels();
};

}  // namespace evalbus
