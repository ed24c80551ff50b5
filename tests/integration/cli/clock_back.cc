// For LD_PRELOAD: a wall clock that is set back by an hour five times a second. The steady clock is
// unaffected.
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

namespace {

timespec Now(clockid_t clock) {
  timespec now{};
  syscall(SYS_clock_gettime, clock, &now);
  return now;
}

timespec WallClock() {
  static const timespec start = Now(CLOCK_MONOTONIC);
  const timespec steady = Now(CLOCK_MONOTONIC);
  const long ms = (steady.tv_sec - start.tv_sec) * 1000 + (steady.tv_nsec - start.tv_nsec) / 1'000'000;
  timespec wall = Now(CLOCK_REALTIME);
  wall.tv_sec -= 3600 * (ms / 200);
  return wall;
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  if (clock == CLOCK_REALTIME) {
    *time = WallClock();
    return 0;
  }
  return static_cast<int>(syscall(SYS_clock_gettime, clock, time));
}

extern "C" int gettimeofday(timeval* time, void*) noexcept {
  const timespec wall = WallClock();
  *time = {wall.tv_sec, wall.tv_nsec / 1000};
  return 0;
}

extern "C" time_t time(time_t* time) noexcept {
  const timespec wall = WallClock();
  if (time != nullptr) *time = wall.tv_sec;
  return wall.tv_sec;
}
