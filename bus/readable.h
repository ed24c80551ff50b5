// Waits for something to read.
#pragma once

#include <poll.h>
#include <time.h>

#include <chrono>
#include <cstdint>

namespace evalbus {

// From now on; nothing left is 0.
inline timespec TimeUntil(std::chrono::steady_clock::time_point deadline) {
  const auto now = std::chrono::steady_clock::now();
  const int64_t ns = deadline <= now ? 0 : std::chrono::nanoseconds(deadline - now).count();
  return {ns / 1'000'000'000, ns % 1'000'000'000};
}

// False if the deadline came first, or a signal, after which the caller looks at its flags. fd: -1 for
// nothing.
inline bool WaitReadable(int fd, std::chrono::steady_clock::time_point deadline) {
  pollfd readable{fd, POLLIN, 0};
  const timespec left = TimeUntil(deadline);
  return ppoll(&readable, 1, &left, nullptr) > 0;
}

}  // namespace evalbus
