#include "base/reserved_stdout.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>

#include "base/file_errors.h"

namespace evalbus {

ReservedStdout::ReservedStdout(bool discards_text) : fd_(-1) {
  std::fflush(stdout);
  fd_ = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0);
  const int text = discards_text ? open("/dev/null", O_WRONLY | O_CLOEXEC) : STDERR_FILENO;
  if (fd_ < 0 || text < 0 || dup2(text, STDOUT_FILENO) < 0) ThrowFileError("standard output", errno);
  if (discards_text) close(text);
  // Without SIGPIPE, writing to a pipe without a reader fails with an error, which is reported.
  std::signal(SIGPIPE, SIG_IGN);
}

ReservedStdout::~ReservedStdout() {
  std::fflush(stdout);
  dup2(fd_, STDOUT_FILENO);
  close(fd_);
}

void ReservedStdout::Write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t size = write(fd_, bytes.data(), bytes.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) ThrowFileError("cannot write standard output", errno);
    bytes.remove_prefix(static_cast<size_t>(size));
  }
}

bool ReservedStdout::has_reader() const {
  pollfd output{fd_, 0, 0};
  return poll(&output, 1, 0) <= 0 || (output.revents & POLLERR) == 0;
}

}  // namespace evalbus
