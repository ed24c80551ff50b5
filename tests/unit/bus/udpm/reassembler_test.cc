#include "bus/udpm/reassembler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "tests/unit/allocation_count.h"
#include "tests/unit/lcm_datagram.h"

namespace evalbus::reassembler_test {

using testing::ElementsAre;
using testing::IsEmpty;

// Collects "CHANNEL:data" of each message that is reassembled from datagrams.
class ReassemblerTest : public testing::Test {
 protected:
  void Receive(const std::string& datagram, uint64_t sender = 1) {
    const auto parsed = ParseDatagram(AsBytes(datagram));
    const auto message = reassembler_.Add(sender, std::get<LcmFragment>(parsed));
    if (!message) return;
    received_.push_back(std::string(message->channel) + ":" +
                        std::string(message->data.begin(), message->data.end()));
  }
  void ReceiveAll(const std::vector<std::string>& datagrams, uint64_t sender = 1) {
    for (const std::string& datagram : datagrams) Receive(datagram, sender);
  }

  Reassembler reassembler_;
  std::vector<std::string> received_;
};

TEST_F(ReassemblerTest, PartsInOrder) {
  ReceiveAll(Fragments(1, "A", "0123456789", 4));
  EXPECT_THAT(received_, ElementsAre("A:0123456789"));
  EXPECT_EQ(reassembler_.lost(), 0);
}

TEST_F(ReassemblerTest, OnePartAlone) {
  ReceiveAll(Fragments(1, "A", "", 9));
  ReceiveAll(Fragments(2, "A", "x", 9));
  EXPECT_THAT(received_, ElementsAre("A:", "A:x"));
}

TEST_F(ReassemblerTest, LaterPartsInAnyOrder) {
  const auto parts = Fragments(1, "A", "0123456789", 4);
  for (const size_t i : {0u, 2u, 1u}) Receive(parts[i]);
  EXPECT_THAT(received_, ElementsAre("A:0123456789"));
}

TEST_F(ReassemblerTest, PartsOfSeveralSendersInterleave) {
  const auto a = Fragments(7, "A", "aaaaaa", 4), b = Fragments(7, "B", "bbbbbb", 4);
  for (size_t i = 0; i < a.size(); ++i) {
    Receive(a[i], 1);
    Receive(b[i], 2);
  }
  EXPECT_THAT(received_, ElementsAre("A:aaaaaa", "B:bbbbbb"));
}

TEST_F(ReassemblerTest, AMessageThatLacksAPartIsLostAndTheNextIsNot) {
  for (const size_t lacking : {0u, 1u, 2u}) {
    auto parts = Fragments(1, "A", "0123456789", 4);
    parts.erase(parts.begin() + static_cast<ptrdiff_t>(lacking));
    ReceiveAll(parts);
    ReceiveAll(Fragments(2, "A", "next", 4));
  }
  EXPECT_THAT(received_, ElementsAre("A:next", "A:next", "A:next"));
  // A message whose first fragment is lost is ignored and not counted.
  EXPECT_EQ(reassembler_.lost(), 2);
}

TEST_F(ReassemblerTest, APartThatComesAgainCountsOnce) {
  const auto parts = Fragments(1, "A", "0123456789", 4);
  for (const size_t i : {0u, 0u, 1u, 1u, 0u}) Receive(parts[i]);
  EXPECT_THAT(received_, IsEmpty());
  Receive(parts[2]);
  EXPECT_THAT(received_, ElementsAre("A:0123456789"));
  // These fragments are duplicates of a complete message.
  Receive(parts[2]);
  Receive(parts[1]);
  EXPECT_EQ(received_.size(), 1u);
}

TEST_F(ReassemblerTest, PartsThatOverlapOrLeaveAGapMakeNoMessage) {
  Receive(FragmentDatagram(1, 6, 0, 0, 2, std::string("A\0abc", 5)));
  Receive(FragmentDatagram(1, 6, 2, 1, 2, "cdef"));
  Receive(FragmentDatagram(2, 6, 0, 0, 2, std::string("A\0ab", 4)));
  Receive(FragmentDatagram(2, 6, 3, 1, 2, "def"));
  Receive(FragmentDatagram(3, 6, 0, 0, 2, std::string("A\0ab", 4)));
  Receive(FragmentDatagram(3, 6, 2, 1, 2, "cde"));
  // These two fragments differ but have the same number.
  Receive(FragmentDatagram(4, 6, 0, 0, 3, std::string("A\0ab", 4)));
  Receive(FragmentDatagram(4, 6, 2, 1, 3, "cd"));
  Receive(FragmentDatagram(4, 6, 4, 1, 3, "ef"));
  EXPECT_THAT(received_, IsEmpty());
  EXPECT_EQ(reassembler_.lost(), 4);
  ReceiveAll(Fragments(5, "A", "good", 4));
  EXPECT_THAT(received_, ElementsAre("A:good"));
}

TEST_F(ReassemblerTest, ALargerMessageOfTheSameSender) {
  ReceiveAll(Fragments(1, "A", "x", 9));
  const std::string large(100'000, 'y');
  ReceiveAll(Fragments(2, "A", large, 60'000));
  ReceiveAll(Fragments(3, "B", "zz", 9));
  EXPECT_THAT(received_, ElementsAre("A:x", "A:" + large, "B:zz"));
}

TEST_F(ReassemblerTest, MemoryIsBoundedWhateverIsSent) {
  const int64_t before = AllocatedBytes();
  // Each fragment claims a message of 64 MB. The sender that was silent longest must be dropped.
  for (uint64_t sender = 0; sender < 10; ++sender) {
    Receive(FragmentDatagram(1, 64 << 20, 0, 0, 1100, std::string("A\0x", 3)), sender);
  }
  EXPECT_EQ(reassembler_.lost(), 8);
  EXPECT_LT(AllocatedBytes() - before, 11 * (int64_t{64} << 20));
  for (uint64_t sender = 100; sender < 1100; ++sender) {
    Receive(FragmentDatagram(1, 1000, 0, 0, 2, std::string("A\0x", 3)), sender);
  }
  EXPECT_EQ(reassembler_.lost(), 10 + 1000 - static_cast<int64_t>(Reassembler::kMaxSenders));
  ReceiveAll(Fragments(9, "A", "still received", 7), 5000);
  EXPECT_THAT(received_, ElementsAre("A:still received"));
}

}  // namespace evalbus::reassembler_test
