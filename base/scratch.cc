#include "base/scratch.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <string_view>

#include "base/file_errors.h"
#include "base/this_process.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "evalbus-", kSuffix = "-XXXXXX";

// The lock is an fcntl() lock, because a run locks its folder with flock(), and that folder may be the same
// one.
struct flock LockOf(short type) {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  return lock;
}

bool IsLocked(int fd) {
  struct flock lock = LockOf(F_WRLCK);
  return fcntl(fd, F_OFD_GETLK, &lock) != 0 || lock.l_type != F_UNLCK;
}

// Returns whether the folder belongs to a process of this user that has ended. Both the process id and the
// lock are checked: a process in another container with this host name may be alive although its id is not in
// use here, and a lock that a process on another machine with the same TMPDIR holds may not be visible here.
bool IsAbandoned(const fs::path& folder, int fd) {
  struct stat status {};
  if (fstat(fd, &status) != 0 || status.st_uid != geteuid()) return false;
  const std::string name = folder.filename();
  return HasEnded(name.substr(kPrefix.size(), name.size() - kPrefix.size() - kSuffix.size())) &&
         !IsLocked(fd);
}

}  // namespace

void RemoveAbandonedScratch(const fs::path& folder) {
  std::error_code error;
  for (auto entry = fs::directory_iterator(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    const std::string name = entry->path().filename();
    if (!name.starts_with(kPrefix) || name.size() <= kPrefix.size() + kSuffix.size()) continue;
    const int fd = open(entry->path().c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) continue;
    std::error_code ignored;
    if (IsAbandoned(entry->path(), fd)) fs::remove_all(entry->path(), ignored);
    close(fd);
  }
}

fs::path FolderOfTemporaryFiles() {
  std::error_code error;
  fs::path folder = fs::temp_directory_path(error);
  if (!error) return folder;
  // The function reads these variables in this order.
  for (const char* name : {"TMPDIR", "TMP", "TEMP", "TEMPDIR"}) {
    if (const char* const value = getenv(name))
      ThrowFileError("folder of temporary files (" + std::string(name) + "): " + value, error.value());
  }
  ThrowFileError("folder of temporary files: /tmp", error.value());
}

Scratch::Scratch() {
  const fs::path all = FolderOfTemporaryFiles();
  [[maybe_unused]] static const bool once = (RemoveAbandonedScratch(all), true);
  std::string name = (all / (std::string(kPrefix) + ThisProcess() + std::string(kSuffix))).string();
  if (!mkdtemp(name.data())) ThrowFileError("cannot create " + name, errno);
  path_ = name;
  fd_ = open(name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  struct flock lock = LockOf(F_RDLCK);
  if (fd_ >= 0) fcntl(fd_, F_OFD_SETLK, &lock);
}

Scratch::~Scratch() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  if (fd_ >= 0) close(fd_);
}

}  // namespace evalbus
