// Receives arbitrary datagrams. The first byte of each selects the sender, and the next two give its length.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "bus/udpm/lcm_wire.h"
#include "bus/udpm/reassembler.h"
#include "tests/fuzz/fuzz_target.h"

FUZZ_TARGET(datagrams) {
  evalbus::Reassembler reassembler;
  std::span<const uint8_t> rest(data, size);
  while (rest.size() >= 3) {
    const uint64_t sender = rest[0];
    const size_t length = std::min<size_t>(size_t{rest[1]} << 8 | rest[2], rest.size() - 3);
    // The datagram is copied, so that AddressSanitizer detects reads beyond its end.
    const std::vector<uint8_t> datagram(rest.begin() + 3, rest.begin() + 3 + static_cast<ptrdiff_t>(length));
    rest = rest.subspan(3 + length);
    const auto parsed = evalbus::ParseDatagram(datagram);
    const auto* fragment = std::get_if<evalbus::LcmFragment>(&parsed);
    if (fragment == nullptr) continue;
    const auto message = reassembler.Add(sender, *fragment);
    if (!message) continue;
    if (message->data.size() != fragment->message_bytes ||
        message->channel.size() > evalbus::kMaxChannelBytes) {
      std::abort();
    }
  }
  return 0;
}
