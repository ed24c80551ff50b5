#include "bus/message.h"

#include <gtest/gtest.h>

#include "evalbus/contacts_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::message_test {

TEST(Message, AHeaderIsReadWithoutTheRest) {
  contacts_t contacts{};
  contacts.header = {0, 3, 1, 127, 2540000};
  std::vector<uint8_t> bytes = Encode(contacts);
  bytes.resize(8 + 32);  // the message is truncated here
  header_t header{};
  ASSERT_TRUE(DecodeHeader<contacts_t>(bytes, &header));
  EXPECT_EQ(header.episode, 3);
  EXPECT_EQ(header.attempt, 1);
  EXPECT_EQ(header.tick, 127);
  EXPECT_FALSE(DecodeHeader<state_t>(bytes, &header));
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeHeader<contacts_t>(std::span(bytes).first(size), &header)) << size;
  }
}

TEST(Message, NewsAreWhatDiffers) {
  std::vector<uint8_t> known;
  EXPECT_TRUE(UpdateIfChanged(std::vector<uint8_t>{1, 2}, &known));
  EXPECT_FALSE(UpdateIfChanged(std::vector<uint8_t>{1, 2}, &known));
  EXPECT_TRUE(UpdateIfChanged(std::vector<uint8_t>{1, 3}, &known));
  EXPECT_EQ(known, (std::vector<uint8_t>{1, 3}));
}

}  // namespace evalbus::message_test
