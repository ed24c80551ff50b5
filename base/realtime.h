// Priority of a process: real-time priority and locked memory, as far as the machine permits them, or low
// priority.
#pragma once

#include <string>

namespace evalbus {

struct Realtime {
  // True if the calling thread has real-time priority (SCHED_FIFO).
  bool is_scheduled = false;
  // True if no memory of the process can be swapped to disk.
  bool is_locked = false;

  // Returns "real-time priority on, memory locked", with "off" or "not locked" for requests that were not
  // granted.
  std::string Words() const;
};

// Requests real-time priority for the calling thread, but not for threads and processes that it starts later,
// and locked memory for this process, but not for its child processes. priority: priority in SCHED_FIFO, 1 to
// 99.
Realtime RequestRealtime(int priority);

// Returns what RequestRealtime(1) would obtain. The request is tried in a child process.
Realtime RealtimeAllowed();

// Lowers this process's priority to nice 10, unless it is lower already, so that it does not slow down
// evaluations. Call it before any thread starts, so that all threads inherit it. On a fully loaded machine, a
// process at nice 19 would receive 1.5 % of a core and show no image for minutes. At nice 10 it receives 10
// %.
void LowerPriority();

}  // namespace evalbus
