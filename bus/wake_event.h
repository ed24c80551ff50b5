// Ends the wait for a message of one thread from another one (Bus::wake_event).
#pragma once

namespace evalbus {

class WakeEvent {
 public:
  // Throws EnvironmentError where no file descriptor is left.
  WakeEvent();
  ~WakeEvent();
  WakeEvent(const WakeEvent&) = delete;
  WakeEvent& operator=(const WakeEvent&) = delete;

  // Thread-safe. Stays set until the next Clear(), so that it may come before the wait.
  void Set();
  void Clear();

  // Readable while it is set.
  int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace evalbus
