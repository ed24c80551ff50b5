// Real-time priority and locked memory, as far as the machine permits them.
#pragma once

#include <string>

namespace evalbus {

struct Realtime {
  // Has real-time priority (SCHED_FIFO).
  bool is_scheduled = false;
  // No memory of the process is swapped to disk.
  bool is_locked = false;

  // "real-time priority on, memory locked", with "off" and "not locked" for what was not granted.
  std::string Words() const;
};

// Requests both for this process, not for its child processes. priority: priority in SCHED_FIFO, 1 to 99.
Realtime RequestRealtime(int priority);

// What RequestRealtime would obtain, tried in a child process.
Realtime RealtimeAllowed();

}  // namespace evalbus
