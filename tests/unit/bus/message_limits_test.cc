// The memory that decoding allocates is bounded by the size of the message, whatever the message contains.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <string_view>
#include <vector>

#include "bus/bus.h"
#include "evalbus/all_messages.hpp"
#include "tests/unit/allocation_count.h"

namespace evalbus::message_limits_test {

template <class Message>
int64_t BytesToDecode(const std::vector<uint8_t>& bytes, bool* decoded = nullptr) {
  Message message{};
  const int64_t before = AllocatedBytes();
  const bool whole = Decode(bytes, &message);
  const int64_t allocated = AllocatedBytes() - before;
  if (decoded) *decoded = whole;
  return allocated;
}

// An element of a vector of strings or of rows takes 32 or 24 bytes in memory, but only five bytes or one on
// the wire. Each of a message's many arrays may be as long as the remaining bytes allow.
constexpr int64_t kBytesPerByte = 300;

TEST(MessageLimits, AbsurdCountsAreDecodeErrors) {
  ForEachMessage([]<class Message>(const Message& empty) {
    const std::vector<uint8_t> bytes = Encode(empty);
    bool decoded = false;
    EXPECT_EQ(BytesToDecode<Message>(bytes, &decoded), 0);
    EXPECT_TRUE(decoded) << Message::getTypeName();
    // In an empty message, every count and length is one of these groups of four bytes.
    for (size_t offset = 8; offset + 4 <= bytes.size(); ++offset) {
      // The counts are -1, the smallest and the largest number, a number of doubles that fill 2^32 bytes, and
      // 2^20.
      for (const uint32_t count : {0xFFFFFFFFu, 0x80000000u, 0x7FFFFFFFu, 0x20000000u, 0x00100000u}) {
        std::vector<uint8_t> absurd = bytes;
        for (size_t i = 0; i < 4; ++i) absurd[offset + i] = static_cast<uint8_t>(count >> (24 - 8 * i));
        ASSERT_LE(BytesToDecode<Message>(absurd), kBytesPerByte * static_cast<int64_t>(bytes.size()))
            << Message::getTypeName() << ", offset " << offset << ", count " << count;
      }
    }
  });
}

TEST(MessageLimits, NoiseBehindTheFingerprintIsHarmless) {
  std::mt19937 random(1);
  ForEachMessage([&]<class Message>(const Message& empty) {
    for (int trial = 0; trial < 1000; ++trial) {
      std::vector<uint8_t> bytes = Encode(empty);
      bytes.resize(8 + random() % 4000);
      // Most counts are small, so that decoding continues to later fields.
      for (size_t i = 8; i < bytes.size(); ++i) bytes[i] = static_cast<uint8_t>(random() % 8 ? 0 : random());
      ASSERT_LE(BytesToDecode<Message>(bytes), kBytesPerByte * static_cast<int64_t>(bytes.size()))
          << Message::getTypeName() << ", trial " << trial;
    }
  });
}

TEST(MessageLimits, ARefusedCountAllocatesNothing) {
  std::vector<uint8_t> bytes = Encode(state_t{});
  // num_qpos follows the fingerprint and the header. It is set to one more than the number of remaining
  // bytes.
  const size_t count_at = 8 + static_cast<size_t>(header_t{}._getEncodedSizeNoHash());
  const auto left = static_cast<uint8_t>(bytes.size() - count_at - 4);
  bool decoded = true;
  bytes[count_at + 3] = static_cast<uint8_t>(left + 1);
  EXPECT_EQ(BytesToDecode<state_t>(bytes, &decoded), 0);
  EXPECT_FALSE(decoded);
}

TEST(MessageLimits, NestedCountsAreLimitedByTheWholeMessage) {
  contacts_t contacts{};
  contacts.num_contacts = 2;
  contacts.contact.resize(2);
  contacts.contact[1].distance_m = -0.25;
  const std::vector<uint8_t> bytes = Encode(contacts);
  contacts_t decoded{};
  ASSERT_TRUE(Decode(bytes, &decoded));
  EXPECT_EQ(decoded.contact[1].distance_m, -0.25);
  // A contact takes 64 bytes, and 65 bytes follow the contacts, so 200 contacts do not fit.
  std::vector<uint8_t> more = bytes;
  const size_t num_contacts =
      8 + 32 + 3;  // last byte of the count, which follows the fingerprint and the header
  ASSERT_EQ(more[num_contacts], 2);
  more[num_contacts] = 200;
  bool whole = true;
  EXPECT_EQ(BytesToDecode<contacts_t>(more, &whole), 0);
  EXPECT_FALSE(whole);
}

TEST(MessageLimits, ATextWithANulInsideIsADecodeError) {
  // Encoding would stop at the NUL. A process that republishes the message would therefore send a message
  // that cannot be decoded.
  episode_end_t end{};
  end.end_reason = "aborted";
  model_info_t model{};
  model.num_bodies = 1;
  model.body_name = {"aborted"};
  model.body_entity = {0};
  const auto is_decoded = []<class Message>(const Message& message, char letter) {
    std::vector<uint8_t> bytes = Encode(message);
    const std::string_view text = "aborted";
    const auto found = std::search(bytes.begin(), bytes.end(), text.begin(), text.end());
    found[3] = static_cast<uint8_t>(letter);
    Message decoded{};
    return Decode(bytes, &decoded);
  };
  EXPECT_TRUE(is_decoded(end, 'x'));
  EXPECT_FALSE(is_decoded(end, '\0'));
  EXPECT_TRUE(is_decoded(model, 'x'));
  EXPECT_FALSE(is_decoded(model, '\0'));
}

TEST(MessageLimits, AnEmptyArrayLeavesNothingOfTheMessageBefore) {
  state_t state{};
  state.num_qpos = 3;
  state.qpos_mixed = {1, 2, 3};
  state_t decoded{};
  ASSERT_TRUE(Decode(Encode(state), &decoded));
  EXPECT_EQ(decoded.qpos_mixed, state.qpos_mixed);
  ASSERT_TRUE(Decode(Encode(state_t{}), &decoded));
  EXPECT_EQ(decoded.qpos_mixed.size(), 0u);
}

}  // namespace evalbus::message_limits_test
