// Real time, as far as a machine lets a process have it.
#pragma once

#include <string>

namespace evalbus {

struct Realtime {
  // Runs before everything that is not so scheduled (SCHED_FIFO).
  bool is_scheduled = false;
  // None of its memory is ever on disk.
  bool is_locked = false;

  // "scheduled before others, memory locked"; what is not is said with "not".
  std::string Words() const;
};

// Asks for both, for this process from now on, not for those that it starts. priority: of SCHED_FIFO, 1
// to 99.
Realtime AskForRealtime(int priority);

// What it would get, found out in a child.
Realtime RealtimeAllowed();

}  // namespace evalbus
