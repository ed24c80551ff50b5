#include "bus/channel_filter.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <vector>

namespace evalbus {
namespace {

// LCM's multicast format: magic u32, sequence number u32, channel name with its NUL, message; magic differs
// for fragments. Offsets count from the UDP header, which is what a filter sees first.
constexpr uint32_t kUdpHeader = 8;
constexpr uint32_t kChannelOffset = kUdpHeader + 8;
constexpr uint32_t kShortMessageMagic = 0x4c433032;
constexpr uint32_t kAccept = 0xFFFFFFFF;

// Classic BPF: one block per channel that compares the name bytewise-exactly, four bytes at a time where
// there are four.
std::vector<sock_filter> Program(std::span<const std::string> channels) {
  std::vector<sock_filter> program = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kUdpHeader),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kShortMessageMagic, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, kAccept),
  };
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

bool IsBoundTo(int fd, int port) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  int type = 0;
  socklen_t type_size = sizeof type;
  return getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &type_size) == 0 && type == SOCK_DGRAM &&
         getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
         address.sin_family == AF_INET && ntohs(address.sin_port) == port;
}

}  // namespace

void FilterChannels(int port, std::span<const std::string> channels) {
  std::vector<std::string> by_length(channels.begin(), channels.end());
  // Shortest first: looking beyond the end of a message drops it, so a long name must not be compared before
  // a short one.
  std::sort(by_length.begin(), by_length.end(),
            [](const auto& a, const auto& b) { return a.size() < b.size(); });
  std::vector<sock_filter> program = Program(by_length);
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  // liblcm does not tell which socket is its own.
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int fd = std::atoi(entry.path().filename().c_str());
    if (!IsBoundTo(fd, port)) continue;
    // A program that inherited the socket would put its own filter on it, which then is ours too.
    fcntl(fd, F_SETFD, FD_CLOEXEC);
    if (channels.empty()) {
      const int unused = 0;
      setsockopt(fd, SOL_SOCKET, SO_DETACH_FILTER, &unused, sizeof unused);
    } else {
      setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter);
    }
  }
}

}  // namespace evalbus
