// Work that forked processes do, each with a copy of everything that this one had, and the memory that they
// share with it.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <string>

namespace evalbus {

// Shared with the processes that are forked later; zeroes at first.
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
  // Begins. what: it does, for messages ("what draws a video"). Of this process' threads only the calling one
  // goes on there. Throws EnvironmentError where no process can be started.
  ForkedWork(std::string what, const std::function<void()>& work);
  // Kills what has not ended.
  ~ForkedWork();
  ForkedWork(const ForkedWork&) = delete;
  ForkedWork& operator=(const ForkedWork&) = delete;

  bool HasEnded();
  // Once it has ended: throws what the work threw (InputError, EnvironmentError, else std::runtime_error),
  // and EnvironmentError where its process died.
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
  // -1: it has ended, with this status.
  pid_t process_ = -1;
  int status_ = 0;
};

}  // namespace evalbus
