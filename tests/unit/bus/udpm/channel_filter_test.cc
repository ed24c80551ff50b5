#include "bus/udpm/channel_filter.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <string>

namespace evalbus::channel_filter_test {

// Two sockets on this machine. The filter is attached to the receiving one.
class ChannelFilterTest : public testing::Test {
 protected:
  ChannelFilterTest() {
    to_.sin_family = AF_INET;
    to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof to_;
    EXPECT_EQ(bind(receiver_, reinterpret_cast<sockaddr*>(&to_), size), 0);
    EXPECT_EQ(getsockname(receiver_, reinterpret_cast<sockaddr*>(&to_), &size), 0);
    FilterChannels(receiver_, false, {});
  }
  ~ChannelFilterTest() override {
    close(receiver_);
    close(sender_);
  }

  // Returns whether a datagram passes the filter. On this machine, a datagram that passes can be read as soon
  // as it has been sent.
  bool Passes(const std::string& datagram) {
    EXPECT_EQ(
        sendto(sender_, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&to_), sizeof to_),
        static_cast<ssize_t>(datagram.size()));
    char buffer[65536];
    return recv(receiver_, buffer, sizeof buffer, MSG_DONTWAIT) >= 0;
  }
  // Returns whether a fragment passes: number `number` of the `count` fragments of a message of `size` bytes,
  // with a header and `data` more bytes.
  bool FragmentPasses(uint32_t size, uint32_t offset, uint16_t number, uint16_t count, size_t data,
                      const std::string& beginning = "") {
    const uint32_t words[] = {htonl(0x4c433033), 0, htonl(size), htonl(offset),
                              htonl(uint32_t{number} << 16 | count)};
    return Passes(std::string(reinterpret_cast<const char*>(words), sizeof words) + beginning +
                  std::string(data - beginning.size(), 'x'));
  }
  // MessagePasses() sends a message in one datagram; FirstPasses() sends the first of three fragments.
  bool MessagePasses(const std::string& channel) {
    return Passes(std::string("LC02\0\0\0\1", 8) + channel + '\0');
  }
  bool FirstPasses(const std::string& channel) {
    return FragmentPasses(2'500, 0, 0, 3, 1'000, channel + '\0');
  }

  int receiver_ = socket(AF_INET, SOCK_DGRAM, 0), sender_ = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to_{};
};

TEST_F(ChannelFilterTest, WhatIsNoMessageIsDropped) {
  EXPECT_TRUE(Passes(std::string("LC02\0\0\0\1EVALBUS_X\0", 18)));
  EXPECT_FALSE(Passes("LC04 something else"));
  EXPECT_FALSE(Passes("LC03 and no more"));
}

// liblcm makes these fragments of 200,000 bytes on a channel whose name has 9 letters. Each except the last
// has 65487 bytes; those of the first include the name and its NUL.
TEST_F(ChannelFilterTest, FragmentsOfARealMessagePass) {
  EXPECT_TRUE(FragmentPasses(200'000, 0, 0, 4, 65487));
  EXPECT_TRUE(FragmentPasses(200'000, 65477, 1, 4, 65487));
  EXPECT_TRUE(FragmentPasses(200'000, 130964, 2, 4, 65487));
  EXPECT_TRUE(FragmentPasses(200'000, 196451, 3, 4, 3549));
  // Other senders may send a single fragment with the channel's name, or smaller fragments.
  EXPECT_TRUE(FragmentPasses(1'000, 0, 0, 1, 1'010));
  EXPECT_TRUE(FragmentPasses(2'500, 0, 0, 3, 1'000));
  EXPECT_TRUE(FragmentPasses(2'500, 1'990, 2, 3, 510));
}

TEST_F(ChannelFilterTest, OnlyWhatIsWantedPasses) {
  const std::string wanted[] = {"EVALBUS_STATE", "EVALBUS_IMAGE_.*", "X"};
  FilterChannels(receiver_, false, wanted);
  for (const char* channel : {"EVALBUS_STATE", "EVALBUS_IMAGE_head", "EVALBUS_IMAGE_", "X"}) {
    EXPECT_TRUE(MessagePasses(channel)) << channel;
    EXPECT_TRUE(FirstPasses(channel)) << channel;
  }
  for (const char* channel : {"EVALBUS_STATES", "EVALBUS_STAT", "EVALBUS_IMAGE", "EVALBUS_IMAGF_head", "",
                              "Y", "XX", "EVALBUS_IMAGE.*"}) {
    EXPECT_FALSE(MessagePasses(channel)) << channel;
    EXPECT_FALSE(FirstPasses(channel)) << channel;
  }
  // Later fragments have no channel name.
  EXPECT_TRUE(FragmentPasses(2'500, 990, 1, 3, 1'000));
  EXPECT_TRUE(FragmentPasses(2'500, 1'990, 2, 3, 510));
  EXPECT_FALSE(FragmentPasses(2'500, 0xFFFFFFF0, 1, 3, 1'000));
  // Accepts every channel.
  const std::string all[] = {"EVALBUS_STATE", ".*"};
  FilterChannels(receiver_, false, all);
  EXPECT_TRUE(MessagePasses("Y"));
  EXPECT_TRUE(FirstPasses("Y"));
  EXPECT_FALSE(Passes("LC04 something else"));
}

TEST_F(ChannelFilterTest, AFragmentOfMoreThanAllOfThemHoldIsDropped) {
  EXPECT_FALSE(FragmentPasses(60'000'000, 0, 0, 1, 20));
  EXPECT_FALSE(FragmentPasses(1'001, 0, 0, 1, 1'000));
  EXPECT_FALSE(FragmentPasses(60'000'000, 0, 0, 1'000, 20));
  EXPECT_FALSE(FragmentPasses(60'000'000, 1'000, 1, 1'000, 20));
  // The last fragment can be checked only against the number of fragments.
  EXPECT_TRUE(FragmentPasses(65'487 * 3, 100, 2, 3, 20));
  EXPECT_FALSE(FragmentPasses(65'487 * 3 + 1, 100, 2, 3, 20));
  EXPECT_FALSE(FragmentPasses(20, 0, 0, 0, 20));
}

TEST_F(ChannelFilterTest, AFragmentOutsideOfItsMessageIsDropped) {
  EXPECT_FALSE(FragmentPasses(200'000, 0xFFFFFFF0, 1, 4, 65'487));
  EXPECT_FALSE(FragmentPasses(200'000, 65'487, 0, 4, 65'487));
  EXPECT_FALSE(FragmentPasses(0xFFFFFFFF, 0, 0, 0xFFFF, 65'487));
}

}  // namespace evalbus::channel_filter_test
