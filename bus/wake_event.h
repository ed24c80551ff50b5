// Ends one thread's wait for a message from another thread (Bus::wake_event).
#pragma once

namespace evalbus {

class WakeEvent {
 public:
  // Throws EnvironmentError if no file descriptor is left.
  WakeEvent();
  ~WakeEvent();
  WakeEvent(const WakeEvent&) = delete;
  WakeEvent& operator=(const WakeEvent&) = delete;

  // Thread-safe. Stays set until the next Clear(), so it may be set before the wait.
  void Set();
  void Clear();

  // Returns the file descriptor that is readable while the event is set.
  int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace evalbus
