#include "results/run_files_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

#include "base/file_errors.h"
#include "base/run_layout.h"

namespace evalbus::results {

RunFilesLock::RunFilesLock(const std::filesystem::path& run) {
  const std::filesystem::path folder = run / kEpisodesFolder;
  fd_ = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd_ < 0) ThrowFileError(folder.string() + ": cannot be opened", errno);
  int result = 0;
  do {
    result = flock(fd_, LOCK_EX);
  } while (result != 0 && errno == EINTR);
  if (result == 0) return;
  const int error = errno;
  close(fd_);
  ThrowFileError(folder.string() + ": cannot be locked", error);
}

RunFilesLock::~RunFilesLock() { close(fd_); }

}  // namespace evalbus::results
