// Detects a second publisher on a channel. With one publisher, all messages about the same tick of an episode
// have equal bytes. Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace evalbus {

class ConflictDetector {
 public:
  enum class Answer { kNew, kRepeated, kConflicting };

  // Begins an episode and discards the messages of the previous one.
  void Start() {
    received_.clear();
    conflict_.clear();
  }

  // Compares a message with the earlier messages on its channel for the same tick. tick: must not be
  // negative. Memory grows with the highest tick.
  Answer Check(std::string_view channel, int64_t tick, std::span<const uint8_t> data) {
    auto found = received_.find(channel);
    if (found == received_.end()) found = received_.emplace(channel, std::vector<size_t>()).first;
    std::vector<size_t>& hashes = found->second;
    const auto index = static_cast<size_t>(tick);
    if (index >= hashes.size()) hashes.resize(index + 1, kNone);
    const std::string_view bytes(reinterpret_cast<const char*>(data.data()), data.size());
    const size_t hash = std::hash<std::string_view>{}(bytes) | 1;
    if (hashes[index] == kNone) {
      hashes[index] = hash;
      return Answer::kNew;
    }
    if (hashes[index] == hash) return Answer::kRepeated;
    if (conflict_.empty()) {
      conflict_ = "two different messages on " + std::string(channel) + " for tick " + std::to_string(tick) +
                  ": is a second publisher on this bus?";
    }
    return Answer::kConflicting;
  }

  // Returns one line about the first conflict of the episode; empty if there was no conflict.
  const std::string& conflict() const { return conflict_; }

 private:
  static constexpr size_t kNone = 0;

  // Hashes of messages by channel, then by tick.
  std::map<std::string, std::vector<size_t>, std::less<>> received_;
  std::string conflict_;
};

}  // namespace evalbus
