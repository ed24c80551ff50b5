// Waits until a file descriptor is readable.
#pragma once

#include <poll.h>
#include <time.h>

#include <chrono>
#include <cstdint>

namespace evalbus {

// Returns the time from now to the deadline; 0 if it has passed.
inline timespec TimeUntil(std::chrono::steady_clock::time_point deadline) {
  const auto now = std::chrono::steady_clock::now();
  const int64_t ns = deadline <= now ? 0 : std::chrono::nanoseconds(deadline - now).count();
  return {ns / 1'000'000'000, ns % 1'000'000'000};
}

// Returns true when `fd` is readable. Returns false at the deadline, after a signal (whose flags the caller
// must check), or when only `wake_fd` is readable. A descriptor of -1 is ignored.
inline bool WaitReadable(int fd, int wake_fd, std::chrono::steady_clock::time_point deadline) {
  pollfd readable[] = {{fd, POLLIN, 0}, {wake_fd, POLLIN, 0}};
  const timespec left = TimeUntil(deadline);
  return ppoll(readable, 2, &left, nullptr) > 0 && readable[0].revents != 0;
}

}  // namespace evalbus
