// Receives messages of an LCM multicast group in the thread that handles them. This halves the number of
// wake-ups: liblcm receives in a separate thread, which then wakes the handling thread through a pipe.
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

#include "bus/udpm/lcm_wire.h"
#include "bus/udpm/reassembler.h"

namespace evalbus {

struct MulticastAddress {
  in_addr group{};
  uint16_t port = 7667;
  // True if messages from other machines are dropped.
  bool is_local = true;
  // Size of the receive buffer that is requested from the kernel.
  int receive_buffer_bytes = 0;
};

// Throws InputError if ADDRESS:PORT of a udpm:// URL is malformed; both parts are optional. Without this
// check, liblcm would fail without stating the cause.
void CheckMulticastAddress(const std::string& url);

// Parses "udpm://ADDRESS:PORT?ttl=0&recv_buf_size=BYTES" as liblcm does. The URL must be one that liblcm has
// accepted. Each part may be missing. default_buffer_bytes: used if the URL has no recv_buf_size.
MulticastAddress ParseMulticastUrl(const std::string& url, int default_buffer_bytes);

class MulticastReceiver {
 public:
  using Time = std::chrono::steady_clock::time_point;
  struct Received {
    // Views that are valid until the next call of Next().
    LcmMessage message;
    // Wall-clock time, microseconds since the Unix epoch.
    int64_t time_us = 0;
  };

  // Joins the group on the interface on which liblcm sends. channels: as in FilterChannels(). wake_fd: Next()
  // stops waiting when it becomes readable; -1: none. Throws std::system_error.
  MulticastReceiver(const MulticastAddress& address, std::span<const std::string> channels, int wake_fd = -1);
  ~MulticastReceiver();
  MulticastReceiver(const MulticastReceiver&) = delete;
  MulticastReceiver& operator=(const MulticastReceiver&) = delete;

  void Filter(std::span<const std::string> channels);

  // Waits for the next message until the deadline; does not wait if the deadline is Time::min(). Returns
  // nullopt after a signal or when wake_fd is readable.
  std::optional<Received> Next(Time deadline);

  // Allows messages to be delayed by up to `delay`, so that one wake-up serves many. The receive buffer may
  // limit the delay further. The first message after a pause is not delayed.
  void SetMaxBatchDelay(std::chrono::nanoseconds delay);

  // Returns the size of the receive buffer that the kernel granted.
  size_t receive_buffer_bytes() const { return buffer_bytes_; }
  // Returns the number of incomplete messages; see Reassembler::lost().
  int64_t lost() const { return reassembler_.lost(); }

 private:
  static constexpr size_t kBatch = 16;

  // Reads up to kBatch queued datagrams. Returns false if there are none.
  bool Take();
  // Returns false if nothing can be read before the deadline.
  bool Wait(Time deadline);
  std::optional<Received> Open(size_t index);

  int fd_ = -1;
  int wake_fd_;
  bool is_local_;
  size_t buffer_bytes_ = 0;
  std::chrono::nanoseconds max_batch_delay_{};
  // True if something was read since the last wait.
  bool is_busy_ = false;

  std::unique_ptr<uint8_t[]> bytes_;
  std::vector<uint8_t> control_;
  std::vector<iovec> places_;
  std::vector<sockaddr_in> senders_;
  std::vector<mmsghdr> batch_;
  // Number of datagrams in the batch, and index of the next one.
  size_t taken_ = 0, next_ = 0;
  Reassembler reassembler_;
};

}  // namespace evalbus
