#include "bus/udpm/lcm_wire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/lcm_datagram.h"

namespace evalbus::lcm_wire_test {

using testing::ElementsAre;

bool IsNothing(const std::string& datagram) { return ParseDatagram(AsBytes(datagram)).index() == 0; }

// The bytes that liblcm's lcm_publish("AB", {7, 8}) sends, written out by hand.
TEST(LcmWire, AMessage) {
  const uint8_t datagram[] = {'L', 'C', '0', '2', 0, 0, 0, 9, 'A', 'B', 0, 7, 8};
  const auto parsed = ParseDatagram(datagram);
  const auto& message = std::get<LcmMessage>(parsed);
  EXPECT_EQ(message.channel, "AB");
  EXPECT_THAT(message.data, ElementsAre(7, 8));
}

TEST(LcmWire, AMessageWithoutData) {
  const std::string datagram = MessageDatagram(0, "C", "");
  const auto parsed = ParseDatagram(AsBytes(datagram));
  EXPECT_EQ(std::get<LcmMessage>(parsed).channel, "C");
  EXPECT_TRUE(std::get<LcmMessage>(parsed).data.empty());
}

TEST(LcmWire, TheFirstFragmentHasTheChannel) {
  const uint8_t datagram[] = {'L', 'C', '0', '3', 0, 0, 1, 2, 0,   0, 0, 5,
                              0,   0,   0,   0,   0, 0, 0, 2, 'A', 0, 7, 8};
  const auto parsed = ParseDatagram(datagram);
  const auto& fragment = std::get<LcmFragment>(parsed);
  EXPECT_EQ(fragment.sequence, 0x102u);
  EXPECT_EQ(fragment.message_bytes, 5u);
  EXPECT_EQ(fragment.offset, 0u);
  EXPECT_EQ(fragment.number, 0);
  EXPECT_EQ(fragment.count, 2);
  EXPECT_EQ(fragment.channel, "A");
  EXPECT_THAT(fragment.data, ElementsAre(7, 8));
}

TEST(LcmWire, LaterFragmentsHaveDataAlone) {
  const std::string datagram = FragmentDatagram(1, 5, 2, 1, 2, "xyz");
  const auto parsed = ParseDatagram(AsBytes(datagram));
  const auto& fragment = std::get<LcmFragment>(parsed);
  EXPECT_EQ(fragment.channel, "");
  EXPECT_EQ(fragment.offset, 2u);
  EXPECT_THAT(fragment.data, ElementsAre('x', 'y', 'z'));
}

TEST(LcmWire, WhatIsCutOrForeignIsNothing) {
  const std::string message = MessageDatagram(1, "CHANNEL", "");
  for (size_t size = 0; size < message.size(); ++size)
    EXPECT_TRUE(IsNothing(message.substr(0, size))) << size;
  const std::string fragment = FragmentDatagram(1, 3, 0, 0, 1, std::string("C\0abc", 5));
  for (size_t size = 0; size < 22; ++size) EXPECT_TRUE(IsNothing(fragment.substr(0, size))) << size;
  EXPECT_TRUE(IsNothing("LC04" + message.substr(4)));
}

TEST(LcmWire, AChannelHasAtMost63Letters) {
  EXPECT_FALSE(IsNothing(MessageDatagram(1, std::string(63, 'c'), "x")));
  EXPECT_TRUE(IsNothing(MessageDatagram(1, std::string(64, 'c'), "x")));
}

TEST(LcmWire, FragmentsThatCannotBeAreNothing) {
  EXPECT_TRUE(IsNothing(FragmentDatagram(1, 4, 2, 1, 2, "xyz")));  // beyond the end of the message
  EXPECT_TRUE(
      IsNothing(FragmentDatagram(1, 4, 0xFFFFFFFF, 1, 2, "xyz")));  // beyond the end, with an overflowing sum
  EXPECT_TRUE(IsNothing(FragmentDatagram(1, 5, 2, 2, 2, "xyz")));   // number 2 of the numbers 0 and 1
  EXPECT_TRUE(IsNothing(FragmentDatagram(1, (64 << 20) + 1, 2, 1, 2, "x")));  // message above the size limit
}

}  // namespace evalbus::lcm_wire_test
