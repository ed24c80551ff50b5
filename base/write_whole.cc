#include "base/write_whole.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "base/errors.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void Throw(const fs::path& file, int error) {
  const std::string what = "cannot write " + file.string() + ": " + std::strerror(error);
  switch (error) {
    case ENOENT:
    case ENOTDIR:
    case EISDIR:
    case EACCES:
    case EPERM:
    case ENAMETOOLONG:
    case ELOOP:
      throw InputError(what);
    default:
      throw EnvironmentError(what);
  }
}

// An open file; every failure throws, in the name of `shown`.
class File {
 public:
  File(const fs::path& shown, const fs::path& file, int flags)
      : shown_(shown), fd_(open(file.c_str(), O_CLOEXEC | flags, 0666)) {
    Check(fd_ >= 0);
  }
  ~File() {
    if (fd_ >= 0) close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  void Write(const std::string& text) {
    for (size_t done = 0; done < text.size();) {
      const ssize_t n = write(fd_, text.data() + done, text.size() - done);
      Check(n >= 0 || errno == EINTR);
      if (n > 0) done += static_cast<size_t>(n);
    }
  }
  void TakePermissionsOf(const struct stat& other) { Check(fchmod(fd_, other.st_mode & 07777) == 0); }
  void Sync() { Check(fsync(fd_) == 0); }

 private:
  void Check(bool good) const {
    if (!good) Throw(shown_, errno);
  }

  const fs::path& shown_;
  int fd_;
};

// Removes a file unless told that it is wanted.
class Removed {
 public:
  explicit Removed(fs::path file) : file_(std::move(file)) {}
  ~Removed() {
    std::error_code ignored;
    if (!kept_) fs::remove(file_, ignored);
  }
  Removed(const Removed&) = delete;
  Removed& operator=(const Removed&) = delete;
  void Keep() { kept_ = true; }

 private:
  fs::path file_;
  bool kept_ = false;
};

// Where a link leads, though nothing may be there yet; so that the link stays one.
fs::path Target(const fs::path& file) {
  fs::path target = file;
  std::error_code error;
  for (int links = 0; fs::is_symlink(fs::symlink_status(target, error)); ++links) {
    constexpr int kMostLinks = 40;  // as Linux follows
    if (links == kMostLinks) Throw(file, ELOOP);
    const fs::path next = fs::read_symlink(target, error);
    if (error) Throw(file, error.value());
    target = target.parent_path() / next;
  }
  return target;
}

}  // namespace

void WriteWhole(const fs::path& file, const std::string& text) {
  struct stat before {};
  const bool exists = stat(file.c_str(), &before) == 0;
  if (exists && S_ISDIR(before.st_mode)) Throw(file, EISDIR);
  if (exists && !S_ISREG(before.st_mode)) return File(file, file, O_WRONLY).Write(text);
  const fs::path target = Target(file);
  const fs::path temporary = target.string() + "." + std::to_string(getpid()) + kTemporaryEnding;
  Removed removed(temporary);
  {
    File written(file, temporary, O_WRONLY | O_CREAT | O_TRUNC);
    written.Write(text);
    if (exists) written.TakePermissionsOf(before);
    written.Sync();
  }
  if (std::rename(temporary.c_str(), target.c_str()) != 0) Throw(file, errno);
  removed.Keep();
}

}  // namespace evalbus
