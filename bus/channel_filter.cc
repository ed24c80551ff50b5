#include "bus/channel_filter.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <vector>

#include "bus/message.h"

namespace evalbus {
namespace {

// LCM's multicast format: magic u32, sequence number u32, channel name with its NUL, message. A fragment has
// another magic and, behind the sequence number, the size of the whole message u32, where in it the fragment
// belongs u32, its number u16, how many there are u16; number 0 goes on with the channel. Offsets count from
// the UDP header, which is what a filter sees first.
constexpr uint32_t kUdpHeader = 8;
constexpr uint32_t kChannelOffset = kUdpHeader + 8;
constexpr uint32_t kMessageSizeOffset = kUdpHeader + 8;
constexpr uint32_t kFragmentOffset = kUdpHeader + 12;
constexpr uint32_t kFragmentNumberOffset = kUdpHeader + 16;
constexpr uint32_t kFragmentCountOffset = kUdpHeader + 18;
constexpr uint32_t kFragmentDataOffset = kUdpHeader + 20;
constexpr uint32_t kMaxFragmentData = 65507 - 20;  // of the largest datagram
constexpr uint32_t kShortMessageMagic = 0x4c433032;
constexpr uint32_t kFragmentMagic = 0x4c433033;
// Offset and length of a fragment, added, stay below 2^32.
constexpr uint32_t kMaxMessage = kMaxMessageBytes;
constexpr uint32_t kAccept = 0xFFFFFFFF;

// Classic BPF. One block per channel compares the name bytewise-exactly, four bytes at a time where there are
// four.
std::vector<sock_filter> Program(bool is_local, std::span<const std::string> channels) {
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
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kShortMessageMagic, 26, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kFragmentMagic, 0, 24),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kMessageSizeOffset),
      BPF_JUMP(BPF_JMP | BPF_JGT | BPF_K, kMaxMessage, 22, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kFragmentOffset),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0, 3, 0),
      BPF_JUMP(BPF_JMP | BPF_JGT | BPF_K, kMaxMessage, 19, 0),
      // The first one begins at 0: liblcm takes the channel's name off its length.
      BPF_STMT(BPF_LD | BPF_H | BPF_ABS, kFragmentNumberOffset),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0, 17, 0),
      // All carry equal parts but the last of several, which may be short.
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
      // So many of them, which stays below 2^32, hold what the message claims to be.
      BPF_STMT(BPF_MISC | BPF_TAX, 0),
      BPF_STMT(BPF_LD | BPF_H | BPF_ABS, kFragmentCountOffset),
      BPF_STMT(BPF_ALU | BPF_MUL | BPF_X, 0),
      BPF_STMT(BPF_MISC | BPF_TAX, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kMessageSizeOffset),
      BPF_JUMP(BPF_JMP | BPF_JGT | BPF_X, 0, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, kAccept),
      BPF_STMT(BPF_RET | BPF_K, 0),
  };
  program.insert(program.end(), std::begin(head), std::end(head));
  if (channels.empty()) {
    program.push_back(BPF_STMT(BPF_RET | BPF_K, kAccept));
    return program;
  }
  for (const std::string& channel : channels) {
    const size_t size = channel.size() + 1;  // with the NUL
    const auto byte = [&](size_t i) {
      return static_cast<uint32_t>(static_cast<uint8_t>(channel.c_str()[i]));
    };
    const size_t comparisons = size / 4 + size % 4;
    size_t left = comparisons;  // a mismatch jumps over the comparisons that follow and the accepting return
    for (size_t i = 0; i < size; i += size - i >= 4 ? 4 : 1) {
      const bool word = size - i >= 4;
      const uint32_t value =
          word ? byte(i) << 24 | byte(i + 1) << 16 | byte(i + 2) << 8 | byte(i + 3) : byte(i);
      --left;
      program.push_back(
          BPF_STMT(BPF_LD | BPF_ABS | (word ? BPF_W : BPF_B), kChannelOffset + static_cast<uint32_t>(i)));
      program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, static_cast<uint8_t>(2 * left + 1)));
    }
    program.push_back(BPF_STMT(BPF_RET | BPF_K, kAccept));
  }
  program.push_back(BPF_STMT(BPF_RET | BPF_K, 0));
  return program;
}

// Where a UDP socket is bound; 0 where that is nowhere, -1 for everything else.
int UdpPort(int fd) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  int type = 0;
  socklen_t type_size = sizeof type;
  const bool is_udp = getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &type_size) == 0 && type == SOCK_DGRAM &&
                      getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
                      address.sin_family == AF_INET;
  return is_udp ? ntohs(address.sin_port) : -1;
}

}  // namespace

void FilterChannels(int port, bool is_local, std::span<const std::string> channels) {
  std::vector<std::string> by_length(channels.begin(), channels.end());
  // Shortest first: looking beyond the end of a message drops it, so a long name must not be compared before
  // a short one.
  std::sort(by_length.begin(), by_length.end(),
            [](const auto& a, const auto& b) { return a.size() < b.size(); });
  std::vector<sock_filter> program = Program(is_local, by_length);
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  // liblcm does not tell which socket is its own.
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int fd = std::atoi(entry.path().filename().c_str());
    const int bound = UdpPort(fd);
    if (bound < 0) continue;
    // A program that inherited the socket would put its own filter on it, which then is ours too; and what
    // it does not know of, it cannot close.
    fcntl(fd, F_SETFD, FD_CLOEXEC);
    if (bound == port) setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter);
  }
}

}  // namespace evalbus
