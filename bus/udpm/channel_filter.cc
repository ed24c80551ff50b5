#include "bus/udpm/channel_filter.h"

#include <linux/filter.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/socket.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "bus/udpm/lcm_wire.h"

namespace evalbus {
namespace {

// Offsets count from the UDP header, where the data of a socket filter begins.
constexpr uint32_t kUdpHeader = 8;
// Offset of the channel's name in an unfragmented message, and in the first fragment of a message.
constexpr uint32_t kChannelOffset = kUdpHeader + kMessageHeaderBytes;
constexpr uint32_t kFragmentChannelOffset = kUdpHeader + kFragmentHeaderBytes;
constexpr uint32_t kMessageSizeOffset = kUdpHeader + 8;
constexpr uint32_t kFragmentOffset = kUdpHeader + 12;
constexpr uint32_t kFragmentNumberOffset = kUdpHeader + 16;
constexpr uint32_t kFragmentCountOffset = kUdpHeader + 18;
constexpr uint32_t kFragmentDataOffset = kUdpHeader + kFragmentHeaderBytes;
constexpr uint32_t kMaxFragmentData = kMaxDatagramBytes - kFragmentHeaderBytes;
// This limit ensures that offset + length of a fragment is less than 2^32.
constexpr uint32_t kMaxMessage = kMaxMessageBytes;
constexpr uint32_t kAccept = 0xFFFFFFFF;

// Returns the prefix that a channel's name must have. It includes the terminating NUL unless the name is a
// wildcard.
std::string BeginningOf(const std::string& channel) {
  return channel.ends_with(".*") ? channel.substr(0, channel.size() - 2) : channel + '\0';
}

// Returns the filter as a classic BPF program. It has one block per prefix. A block compares all bytes: four
// at a time, and the remaining bytes one at a time.
std::vector<sock_filter> Program(bool is_local, std::span<const std::string> beginnings) {
  std::vector<sock_filter> program;
  if (is_local) {
    program = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<uint32_t>(SKF_AD_OFF + SKF_AD_PKTTYPE)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_LOOPBACK, 3, 0),
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<uint32_t>(SKF_AD_OFF + SKF_AD_IFINDEX)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, if_nametoindex("lo"), 1, 0),
        BPF_STMT(BPF_RET | BPF_K, 0),
    };
  }
  const sock_filter head[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kUdpHeader),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kMessageMagic, 30, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kFragmentMagic, 0, 28),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kMessageSizeOffset),
      BPF_JUMP(BPF_JMP | BPF_JGT | BPF_K, kMaxMessage, 26, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kFragmentOffset),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0, 3, 0),
      BPF_JUMP(BPF_JMP | BPF_JGT | BPF_K, kMaxMessage, 23, 0),
      // The first fragment must have offset 0, because liblcm subtracts the length of the channel's name from
      // the length of this fragment.
      BPF_STMT(BPF_LD | BPF_H | BPF_ABS, kFragmentNumberOffset),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0, 21, 0),
      // All fragments have equal size, except that the last fragment may be shorter.
      BPF_STMT(BPF_LD | BPF_H | BPF_ABS, kFragmentNumberOffset),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0, 4, 0),
      BPF_STMT(BPF_ALU | BPF_ADD | BPF_K, 1),
      BPF_STMT(BPF_MISC | BPF_TAX, 0),
      BPF_STMT(BPF_LD | BPF_H | BPF_ABS, kFragmentCountOffset),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_X, 0, 3, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_LEN, 0),
      BPF_STMT(BPF_ALU | BPF_SUB | BPF_K, kFragmentDataOffset),
      BPF_STMT(BPF_JMP | BPF_JA, 1),
      BPF_STMT(BPF_LD | BPF_IMM, kMaxFragmentData),
      // Fragment count times this size (less than 2^32) must hold the message's claimed size.
      BPF_STMT(BPF_MISC | BPF_TAX, 0),
      BPF_STMT(BPF_LD | BPF_H | BPF_ABS, kFragmentCountOffset),
      BPF_STMT(BPF_ALU | BPF_MUL | BPF_X, 0),
      BPF_STMT(BPF_MISC | BPF_TAX, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kMessageSizeOffset),
      BPF_JUMP(BPF_JMP | BPF_JGT | BPF_X, 0, 5, 0),
      // Only the first fragment contains the channel's name; later fragments pass.
      BPF_STMT(BPF_LD | BPF_H | BPF_ABS, kFragmentNumberOffset),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, kAccept),
      BPF_STMT(BPF_LDX | BPF_W | BPF_IMM, kFragmentChannelOffset),
      BPF_STMT(BPF_JMP | BPF_JA, 2),
      BPF_STMT(BPF_RET | BPF_K, 0),
      // The first jump above leads here for an unfragmented message.
      BPF_STMT(BPF_LDX | BPF_W | BPF_IMM, kChannelOffset),
  };
  program.insert(program.end(), std::begin(head), std::end(head));
  if (beginnings.empty()) {
    program.push_back(BPF_STMT(BPF_RET | BPF_K, kAccept));
    return program;
  }
  for (const std::string& beginning : beginnings) {
    const size_t size = beginning.size();
    const auto byte = [&](size_t i) { return static_cast<uint32_t>(static_cast<uint8_t>(beginning[i])); };
    const size_t comparisons = size / 4 + size % 4;
    size_t left = comparisons;  // a mismatch jumps over the remaining comparisons and the accepting return
    for (size_t i = 0; i < size; i += size - i >= 4 ? 4 : 1) {
      const bool word = size - i >= 4;
      const uint32_t value =
          word ? byte(i) << 24 | byte(i + 1) << 16 | byte(i + 2) << 8 | byte(i + 3) : byte(i);
      --left;
      program.push_back(BPF_STMT(BPF_LD | BPF_IND | (word ? BPF_W : BPF_B), static_cast<uint32_t>(i)));
      program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, static_cast<uint8_t>(2 * left + 1)));
    }
    program.push_back(BPF_STMT(BPF_RET | BPF_K, kAccept));
  }
  program.push_back(BPF_STMT(BPF_RET | BPF_K, 0));
  return program;
}

}  // namespace

void FilterChannels(int fd, bool is_local, std::span<const std::string> channels) {
  std::vector<std::string> beginnings;
  for (const std::string& channel : channels) beginnings.push_back(BeginningOf(channel));
  // Shorter names must be compared first, because a load beyond the end of a message drops the message.
  std::ranges::sort(beginnings, {}, &std::string::size);
  std::vector<sock_filter> program = Program(is_local, beginnings);
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter);
}

}  // namespace evalbus
