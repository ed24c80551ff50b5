#include "bus/udpm/multicast_receiver.h"

#include <arpa/inet.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>

#include "base/errors.h"
#include "base/number_from.h"
#include "base/poll.h"
#include "bus/udpm/channel_filter.h"

namespace evalbus {
namespace {

constexpr size_t kPlaceBytes = 65536;  // slightly more than the largest datagram
constexpr size_t kControlBytes = CMSG_SPACE(sizeof(timeval));
// Upper bound of the data rate: higher than in any measured run, in bytes as the kernel counts them for
// receive buffers.
constexpr int64_t kMaxBytesPerS = 320'000'000;

[[noreturn]] void ThrowErrno() { throw std::system_error(errno, std::generic_category()); }

void Set(int fd, int level, int option, int value) {
  if (setsockopt(fd, level, option, &value, sizeof value) != 0) ThrowErrno();
}

int64_t TimeOf(const msghdr& header) {
  for (const cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr;
       part = CMSG_NXTHDR(const_cast<msghdr*>(&header), const_cast<cmsghdr*>(part))) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMP) continue;
    timeval time{};
    std::memcpy(&time, CMSG_DATA(part), sizeof time);
    return int64_t{time.tv_sec} * 1'000'000 + time.tv_usec;
  }
  return 0;
}

}  // namespace

void CheckMulticastAddress(const std::string& url) {
  constexpr std::string_view kScheme = "udpm://";
  constexpr int kMaxPort = 65535;
  const std::string place = url.substr(kScheme.size(), url.find('?') - kScheme.size());
  const size_t colon = place.find(':');
  const std::string group = place.substr(0, colon);
  const std::string port = colon == std::string::npos ? "7667" : place.substr(colon + 1);
  in_addr address{};
  const int number = NumberFrom<int>(port).value_or(0);
  const bool is_port = number > 0 && number <= kMaxPort;
  if ((group.empty() || inet_aton(group.c_str(), &address) != 0) && is_port) return;
  throw InputError("bus URL '" + url + "': '" + place +
                   "' is not ADDRESS:PORT, for example udpm://239.255.76.67:7667?ttl=0");
}

MulticastAddress ParseMulticastUrl(const std::string& url, int default_buffer_bytes) {
  MulticastAddress address;
  address.receive_buffer_bytes = default_buffer_bytes;
  std::string_view rest = std::string_view(url).substr(std::strlen("udpm://"));
  const std::string_view place = rest.substr(0, rest.find('?'));
  rest.remove_prefix(std::min(rest.size(), place.size() + 1));
  const std::string group(place.substr(0, place.find(':')));
  inet_aton(group.empty() ? "239.255.76.67" : group.c_str(), &address.group);
  if (const size_t colon = place.find(':'); colon != std::string_view::npos) {
    address.port = static_cast<uint16_t>(std::atoi(std::string(place.substr(colon + 1)).c_str()));
  }
  while (!rest.empty()) {
    const std::string option(rest.substr(0, rest.find('&')));
    rest.remove_prefix(std::min(rest.size(), option.size() + 1));
    const auto value = [&](const char* name) -> std::optional<int> {
      if (!option.starts_with(name)) return std::nullopt;
      return std::atoi(option.c_str() + std::strlen(name));
    };
    if (const auto ttl = value("ttl=")) address.is_local = *ttl == 0;
    if (const auto bytes = value("recv_buf_size=")) address.receive_buffer_bytes = *bytes;
  }
  return address;
}

MulticastReceiver::MulticastReceiver(const MulticastAddress& address, std::span<const std::string> channels,
                                     int wake_fd)
    : wake_fd_(wake_fd),
      is_local_(address.is_local),
      bytes_(std::make_unique_for_overwrite<uint8_t[]>(kBatch * kPlaceBytes)),
      control_(kBatch * kControlBytes),
      places_(kBatch),
      senders_(kBatch),
      batch_(kBatch) {
  for (size_t i = 0; i < kBatch; ++i) {
    places_[i] = {bytes_.get() + i * kPlaceBytes, kPlaceBytes};
    batch_[i].msg_hdr = {};
    batch_[i].msg_hdr.msg_iov = &places_[i];
    batch_[i].msg_hdr.msg_iovlen = 1;
    batch_[i].msg_hdr.msg_name = &senders_[i];
    batch_[i].msg_hdr.msg_control = control_.data() + i * kControlBytes;
  }
  fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd_ < 0) ThrowErrno();
  try {
    // The filter is attached before bind(), so that no unfiltered message is queued.
    Filter(channels);
    Set(fd_, SOL_SOCKET, SO_REUSEADDR, 1);
    Set(fd_, SOL_SOCKET, SO_TIMESTAMP, 1);
    Set(fd_, SOL_SOCKET, SO_RCVBUF, address.receive_buffer_bytes);
    int granted = 0;
    socklen_t size = sizeof granted;
    if (getsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &granted, &size) != 0) ThrowErrno();
    buffer_bytes_ = static_cast<size_t>(granted);
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_port = htons(address.port);
    if (bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) ThrowErrno();
    const ip_mreq group{address.group, {INADDR_ANY}};
    // Without this option, the socket also receives messages of groups that other programs of this machine
    // have joined on the same port.
    Set(fd_, IPPROTO_IP, IP_MULTICAST_ALL, 0);
    if (setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) != 0) ThrowErrno();
  } catch (...) {
    close(fd_);
    throw;
  }
}

MulticastReceiver::~MulticastReceiver() { close(fd_); }

void MulticastReceiver::Filter(std::span<const std::string> channels) {
  FilterChannels(fd_, is_local_, channels);
}

void MulticastReceiver::SetMaxBatchDelay(std::chrono::nanoseconds delay) {
  const std::chrono::nanoseconds room(static_cast<int64_t>(buffer_bytes_) * 1'000'000'000 / kMaxBytesPerS);
  max_batch_delay_ = std::min(delay, room);
}

std::optional<MulticastReceiver::Received> MulticastReceiver::Next(Time deadline) {
  for (;;) {
    while (next_ < taken_) {
      if (const auto received = Open(next_++)) return received;
    }
    // If the last batch was only partly filled, the queue was just empty, so waiting is cheaper than reading.
    const bool is_drained = taken_ > 0 && taken_ < kBatch && deadline != Time::min();
    taken_ = next_ = 0;
    if (!is_drained && Take()) continue;
    if (deadline == Time::min() || !Wait(deadline)) return std::nullopt;
    Take();
  }
}

bool MulticastReceiver::Take() {
  for (mmsghdr& message : batch_) {
    message.msg_hdr.msg_namelen = sizeof(sockaddr_in);
    message.msg_hdr.msg_controllen = kControlBytes;
  }
  const int taken = recvmmsg(fd_, batch_.data(), kBatch, MSG_DONTWAIT, nullptr);
  if (taken < 0 && errno != EAGAIN && errno != EINTR) ThrowErrno();
  next_ = 0;
  taken_ = static_cast<size_t>(std::max(0, taken));
  is_busy_ = is_busy_ || taken_ > 0;
  return taken_ > 0;
}

bool MulticastReceiver::Wait(Time deadline) {
  const auto now = std::chrono::steady_clock::now();
  if (deadline <= now) return false;
  if (std::exchange(is_busy_, false) && max_batch_delay_.count() > 0) {
    const timespec pause = TimeUntil(std::min(deadline, now + max_batch_delay_));
    return clock_nanosleep(CLOCK_MONOTONIC, 0, &pause, nullptr) == 0;
  }
  return WaitReadable(fd_, wake_fd_, deadline);
}

std::optional<MulticastReceiver::Received> MulticastReceiver::Open(size_t index) {
  const auto datagram = ParseDatagram({bytes_.get() + index * kPlaceBytes, batch_[index].msg_len});
  const int64_t time_us = TimeOf(batch_[index].msg_hdr);
  if (const auto* message = std::get_if<LcmMessage>(&datagram)) return Received{*message, time_us};
  if (const auto* fragment = std::get_if<LcmFragment>(&datagram)) {
    const uint64_t sender = uint64_t{senders_[index].sin_addr.s_addr} << 16 | senders_[index].sin_port;
    if (const auto message = reassembler_.Add(sender, *fragment)) return Received{*message, time_us};
  }
  return std::nullopt;
}

}  // namespace evalbus
