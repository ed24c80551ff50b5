// Decodes arbitrary bytes as a message of any type. The first byte selects the type, and the fingerprint is
// right.
#include <cstdlib>
#include <vector>

#include "bus/bus.h"
#include "evalbus/all_messages.hpp"
#include "tests/fuzz/fuzz_target.h"

FUZZ_TARGET(messages) {
  if (size == 0) return 0;
  int types = 0, type = 0;
  evalbus::ForEachMessage([&](const auto&) { ++types; });
  evalbus::ForEachMessage([&]<class Message>(const Message& empty) {
    if (type++ != *data % types) return;
    std::vector<uint8_t> bytes(static_cast<size_t>(empty.getEncodedSize()));
    empty.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    bytes.resize(8);
    bytes.insert(bytes.end(), data + 1, data + size);
    Message message{};
    if (!evalbus::Decode(bytes, &message)) return;
    // A decoded message can be encoded again.
    std::vector<uint8_t> again(static_cast<size_t>(message.getEncodedSize()));
    if (message.encode(again.data(), 0, static_cast<int>(again.size())) != static_cast<int>(again.size())) {
      std::abort();
    }
  });
  return 0;
}
