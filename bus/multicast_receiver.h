// What is said in a multicast group of LCM's, read by the thread that handles it. (liblcm has a thread for
// that, which wakes the other by a pipe: two wake-ups for each message.)
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bus/lcm_wire.h"
#include "bus/reassembler.h"

namespace evalbus {

struct MulticastAddress {
  in_addr group{};
  uint16_t port = 7667;
  // No message from another machine is meant for us.
  bool is_local = true;
  // Asked of the kernel.
  int receive_buffer_bytes = 0;
};

// "udpm://ADDRESS:PORT?ttl=0&recv_buf_size=BYTES", as liblcm reads it, which has accepted it. Each part may
// be missing; default_buffer_bytes: the buffer then.
MulticastAddress ParseMulticastUrl(const std::string& url, int default_buffer_bytes);

class MulticastReceiver {
 public:
  using Time = std::chrono::steady_clock::time_point;
  struct Received {
    // Views that hold until the next call.
    LcmMessage message;
    // Wall-clock time.
    int64_t time_us = 0;
  };

  // Joins the group on the interface to which liblcm sends. channels: as of FilterChannels(). wake_fd: Next()
  // stops waiting when it becomes readable; -1: none. Throws std::system_error.
  MulticastReceiver(const MulticastAddress& address, std::span<const std::string> channels, int wake_fd = -1);
  ~MulticastReceiver();
  MulticastReceiver(const MulticastReceiver&) = delete;
  MulticastReceiver& operator=(const MulticastReceiver&) = delete;

  void Filter(std::span<const std::string> channels);

  // The next message, waited for until the deadline, or not at all for Time::min(). Nothing after a signal,
  // or when wake_fd is readable.
  std::optional<Received> Next(Time deadline);

  // Who is in no hurry reads only so often what has come since, as far as the kernel has room for it: one
  // wake-up then serves for many messages. The first one after a silence is heard at once.
  void SetMaxBatchDelay(std::chrono::nanoseconds delay);

  // What the kernel gives it.
  size_t receive_buffer_bytes() const { return buffer_bytes_; }
  // Messages of which fragments are missing or do not fit together.
  int64_t lost() const { return reassembler_.lost(); }

 private:
  static constexpr size_t kBatch = 16;

  // Reads what has queued. False if nothing has.
  bool Take();
  // False if there is nothing to be read before the deadline.
  bool Wait(Time deadline);
  std::optional<Received> Open(size_t index);

  int fd_ = -1;
  int wake_fd_;
  bool is_local_;
  size_t buffer_bytes_ = 0;
  std::chrono::nanoseconds max_batch_delay_{};
  // Something was read since we waited.
  bool is_busy_ = false;

  std::unique_ptr<uint8_t[]> bytes_;
  std::vector<uint8_t> control_;
  std::vector<iovec> places_;
  std::vector<sockaddr_in> senders_;
  std::vector<mmsghdr> batch_;
  // Of the batch: how many were read, and which of them is next.
  size_t taken_ = 0, next_ = 0;
  Reassembler reassembler_;
};

}  // namespace evalbus
