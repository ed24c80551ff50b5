#include "base/forked_work.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "base/errors.h"

namespace evalbus {

SharedMemory::SharedMemory(size_t bytes)
    : bytes_(bytes),
      memory_(mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {
  if (memory_ == MAP_FAILED) {
    throw EnvironmentError(
        fmt::format("cannot allocate {} bytes of shared memory: {}", bytes, std::strerror(errno)));
  }
}

SharedMemory::~SharedMemory() { munmap(memory_, bytes_); }

ForkedWork::ForkedWork(std::string what, const std::function<void()>& work) : what_(std::move(what)) {
  const pid_t parent = getpid();
  process_ = fork();
  if (process_ < 0) {
    throw EnvironmentError(fmt::format("cannot start a process for {}: {}", what_, std::strerror(errno)));
  }
  if (process_ > 0) return;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  const auto fail = [this](Threw threw, const char* message) {
    failure().threw = threw;
    std::strncpy(failure().message, message, sizeof failure().message - 1);
  };
  try {
    work();
  } catch (const InputError& error) {
    fail(Threw::kInputError, error.what());
  } catch (const EnvironmentError& error) {
    fail(Threw::kEnvironmentError, error.what());
  } catch (const std::exception& error) {
    fail(Threw::kOther, error.what());
  }
  // _exit() skips destructors and exit handlers, because buffers inherited from the parent must not be
  // flushed or freed twice.
  _exit(0);
}

ForkedWork::~ForkedWork() {
  if (process_ < 0) return;
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
}

bool ForkedWork::HasEnded() {
  if (process_ > 0 && waitpid(process_, &status_, WNOHANG) == process_) process_ = -1;
  return process_ < 0;
}

void ForkedWork::CheckEnd() const {
  if (WIFSIGNALED(status_)) {
    throw EnvironmentError(fmt::format("{} was ended by a signal: {}", what_, strsignal(WTERMSIG(status_))));
  }
  if (WEXITSTATUS(status_) != 0) {
    throw EnvironmentError(fmt::format("{} ended with exit code {}", what_, WEXITSTATUS(status_)));
  }
  switch (failure().threw) {
    case Threw::kNothing:
      return;
    case Threw::kInputError:
      throw InputError(failure().message);
    case Threw::kEnvironmentError:
      throw EnvironmentError(failure().message);
    case Threw::kOther:
      throw std::runtime_error(failure().message);
  }
}

}  // namespace evalbus
