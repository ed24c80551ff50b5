#include "base/write_whole.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <utility>

#include "base/file_errors.h"
#include "base/number_from.h"
#include "base/this_process.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

// Suffix of a temporary name, "FILE.HOST-PID.tmp". The name contains the host, because processes of several
// machines may write the same file on a shared disk. A dot in the host's name is written as "_", which valid
// host names do not contain.
constexpr char kEnding[] = ".tmp";

std::string TemporaryNameOf(const std::string& file) {
  std::string process = ThisProcess();
  std::ranges::replace(process, '.', '_');
  return file + "." + process + kEnding;
}

[[noreturn]] void Throw(const fs::path& file, int error) {
  ThrowFileError("cannot write " + (file.empty() ? "a file without a name" : file.string()), error);
}

// An open file; every failure throws an error that names `shown`.
class File {
 public:
  File(const fs::path& shown, const fs::path& file, int flags)
      : File(shown, open(file.c_str(), O_CLOEXEC | flags, 0666)) {}
  File(const fs::path& shown, int fd) : shown_(shown), fd_(fd) { Check(fd_ >= 0); }
  ~File() {
    if (fd_ >= 0) close(fd_);
  }
  File(File&& other) noexcept : shown_(other.shown_), fd_(std::exchange(other.fd_, -1)) {}

  void Write(const std::string& text) {
    for (size_t done = 0; done < text.size();) {
      const ssize_t n = write(fd_, text.data() + done, text.size() - done);
      Check(n >= 0 || errno == EINTR);
      if (n > 0) done += static_cast<size_t>(n);
    }
  }
  // The owner is changed before the permissions are set, because changing the owner clears permission bits.
  void TakePermissionsOf(const struct stat& other) {
    Check(fchown(fd_, other.st_uid, other.st_gid) == 0 || errno == EPERM);
    Check(fchmod(fd_, other.st_mode & 07777) == 0);
  }
  void Sync() { Check(fsync(fd_) == 0); }
  // The result is checked, because some file systems report a full disk only when a file is closed.
  void Close() { Check(close(std::exchange(fd_, -1)) == 0); }

 private:
  void Check(bool good) const {
    if (!good) Throw(shown_, errno);
  }

  const fs::path& shown_;
  int fd_;
};

// Returns whether the file is an open file descriptor of this process, such as "/proc/self/fd/1".
bool IsOpenHere(const fs::path& file) {
  std::error_code error;
  const fs::path folder = fs::canonical(file.parent_path(), error);
  return !error && folder == fs::canonical("/proc/self/fd", error) && !error;
}

// Returns the target of a link, because the target, not the link, must be replaced. The target need not exist
// yet.
fs::path Target(const fs::path& file) {
  fs::path target = file;
  std::error_code error;
  for (int links = 0; fs::is_symlink(fs::symlink_status(target, error)) && !IsOpenHere(target); ++links) {
    constexpr int kMaxLinks = 40;  // as in Linux
    if (links == kMaxLinks) Throw(file, ELOOP);
    const fs::path next = fs::read_symlink(target, error);
    if (error) Throw(file, error.value());
    target = target.parent_path() / next;
  }
  return target;
}

}  // namespace

std::optional<TemporaryName> ParseTemporaryName(const std::string& name) {
  if (!name.ends_with(kEnding)) return std::nullopt;
  const std::string rest = name.substr(0, name.size() - (sizeof kEnding - 1));
  const size_t dot = rest.rfind('.');
  if (dot == std::string::npos) return std::nullopt;
  TemporaryName parsed{rest.substr(0, dot), rest.substr(dot + 1)};
  const size_t dash = parsed.process.rfind('-');
  if (dash == 0) return std::nullopt;
  const std::string digits = parsed.process.substr(dash == std::string::npos ? 0 : dash + 1);
  parsed.pid = NumberFrom<pid_t>(digits).value_or(0);
  if (parsed.pid <= 0) return std::nullopt;
  std::ranges::replace(parsed.process, '_', '.');
  return parsed;
}

WholeFile::WholeFile(fs::path file)
    : file_(std::move(file)), target_(Target(file_)), temporary_(TemporaryNameOf(target_)) {
  exists_ = stat(file_.c_str(), &before_) == 0;
  if (exists_ && S_ISDIR(before_.st_mode)) Throw(file_, EISDIR);
  if (exists_ && !S_ISREG(before_.st_mode)) Throw(file_, EEXIST);
}

WholeFile::~WholeFile() {
  std::error_code ignored;
  if (!is_finished_) fs::remove(temporary_, ignored);
}

void WholeFile::Finish() {
  {
    File written(file_, temporary_, O_RDONLY);
    if (exists_) written.TakePermissionsOf(before_);
    written.Sync();
    written.Close();
  }
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0) Throw(file_, errno);
  is_finished_ = true;
}

void WriteWhole(const fs::path& file, const std::string& text) {
  const fs::path target = Target(file);
  const auto write = [&](File written) {
    written.Write(text);
    written.Close();
  };
  // An open file is written to directly, because the program may also write to it before and after this call.
  if (IsOpenHere(target)) return write(File(file, dup(std::atoi(target.filename().c_str()))));
  struct stat before {};
  if (stat(file.c_str(), &before) == 0 && !S_ISREG(before.st_mode) && !S_ISDIR(before.st_mode)) {
    return write(File(file, file, O_WRONLY));
  }
  WholeFile whole(file);
  write(File(file, whole.path(), O_WRONLY | O_CREAT | O_TRUNC));
  whole.Finish();
}

}  // namespace evalbus
