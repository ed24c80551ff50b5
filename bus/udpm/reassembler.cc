#include "bus/udpm/reassembler.h"

#include <algorithm>

namespace evalbus {

std::optional<LcmMessage> Reassembler::Add(uint64_t sender, const LcmFragment& fragment) {
  const auto known = by_sender_.find(sender);
  const bool continues =
      known != by_sender_.end() && known->second.begun && known->second.sequence == fragment.sequence &&
      known->second.message_bytes == fragment.message_bytes && known->second.count == fragment.count;
  if (!continues) {
    if (known != by_sender_.end() && known->second.begun) {
      known->second.begun = false;
      ++lost_;
    }
    if (fragment.number != 0) return std::nullopt;
    MakeRoom(sender, fragment.message_bytes);
    Begin(fragment, &by_sender_[sender]);
  }
  Assembly& assembly = by_sender_[sender];
  assembly.received_at = ++clock_;
  const Part part{fragment.offset, static_cast<uint32_t>(fragment.data.size())};
  const auto [place, is_new] = assembly.parts.try_emplace(fragment.number, part);
  if (!is_new) {
    if (place->second == part) return std::nullopt;
    assembly.begun = false;
    ++lost_;
    return std::nullopt;
  }
  std::ranges::copy(fragment.data, assembly.bytes.get() + fragment.offset);
  if (assembly.parts.size() < assembly.count) return std::nullopt;
  assembly.begun = false;
  if (!IsWithoutGap(assembly)) {
    ++lost_;
    return std::nullopt;
  }
  return LcmMessage{assembly.channel, {assembly.bytes.get(), assembly.message_bytes}};
}

void Reassembler::Begin(const LcmFragment& fragment, Assembly* assembly) {
  assembly->begun = true;
  assembly->sequence = fragment.sequence;
  assembly->message_bytes = fragment.message_bytes;
  assembly->count = fragment.count;
  assembly->channel = fragment.channel;
  assembly->parts.clear();
  if (assembly->capacity < fragment.message_bytes) {
    assembly->bytes = std::make_unique_for_overwrite<uint8_t[]>(fragment.message_bytes);
    assembly->capacity = fragment.message_bytes;
  }
}

void Reassembler::MakeRoom(uint64_t for_sender, size_t bytes) {
  for (;;) {
    size_t num_others = 0, needed = bytes;
    auto oldest = by_sender_.end();
    for (auto sender = by_sender_.begin(); sender != by_sender_.end(); ++sender) {
      if (sender->first == for_sender) continue;
      ++num_others;
      needed += sender->second.capacity;
      if (oldest == by_sender_.end() || sender->second.received_at < oldest->second.received_at)
        oldest = sender;
    }
    if (num_others < kMaxSenders && needed <= kMaxBytes) return;
    if (oldest->second.begun) ++lost_;
    by_sender_.erase(oldest);
  }
}

bool Reassembler::IsWithoutGap(const Assembly& assembly) {
  uint32_t end = 0;
  for (const auto& [number, part] : assembly.parts) {
    if (part.offset != end) return false;
    end += part.size;
  }
  return end == assembly.message_bytes;
}

}  // namespace evalbus
