// Runs work in forked processes, each with a copy of this process's memory, and shares memory with them.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <string>

namespace evalbus {

// Memory shared with processes that are forked later; initialized with zeros.
class SharedMemory {
 public:
  // Throws EnvironmentError.
  explicit SharedMemory(size_t bytes);
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  void* get() const { return memory_; }

 private:
  size_t bytes_;
  void* memory_;
};

class ForkedWork {
 public:
  // Starts the work in a forked process, in which only the calling thread exists. what: name of the work in
  // error messages. Throws EnvironmentError if no process can be started.
  ForkedWork(std::string what, const std::function<void()>& work);
  // Kills the process if it is still running.
  ~ForkedWork();
  ForkedWork(const ForkedWork&) = delete;
  ForkedWork& operator=(const ForkedWork&) = delete;

  bool HasEnded();
  // Must not be called before HasEnded() is true. Rethrows an exception of the work as InputError or
  // EnvironmentError, and any other std::exception as std::runtime_error. Throws EnvironmentError if a signal
  // ended the process or its exit code is not 0.
  void CheckEnd() const;

 private:
  enum class Threw { kNothing, kInputError, kEnvironmentError, kOther };
  struct Failure {
    Threw threw;
    char message[1000];
  };

  Failure& failure() const { return *static_cast<Failure*>(memory_.get()); }

  const std::string what_;
  const SharedMemory memory_{sizeof(Failure)};
  // Process id; -1 after HasEnded() has found that the process has ended, and has set status_.
  pid_t process_ = -1;
  int status_ = 0;
};

}  // namespace evalbus
