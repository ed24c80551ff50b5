#include "base/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "base/errors.h"
#include "base/file_errors.h"

namespace evalbus {
namespace {

// Returns the kind of a file that is not a regular file; null for a regular file.
const char* WhatElse(mode_t mode) {
  if (S_ISREG(mode)) return nullptr;
  return S_ISDIR(mode)    ? "a folder"
         : S_ISFIFO(mode) ? "a named pipe"
         : S_ISSOCK(mode) ? "a socket"
                          : "a device";
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& file, const std::string& what)
    : fault_(file.string() + (what.empty() ? ": cannot be read" : ": cannot read the " + what)) {
  struct stat status {};
  const auto check = [&](bool good) {
    const int error = errno;
    const char* const other = good ? WhatElse(status.st_mode) : nullptr;
    if (good && !other) return;
    if (fd_ >= 0) close(std::exchange(fd_, -1));
    if (!good) Fail(error);
    throw InputError(fault_ + ": " + other + ", expected a file");
  };
  // The file's kind is checked before opening, because opening may affect a device, and again afterwards,
  // because the file may have been replaced.
  check(stat(file.c_str(), &status) == 0);
  fd_ = open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  check(fd_ >= 0 && fstat(fd_, &status) == 0);
  size_ = static_cast<uint64_t>(status.st_size);
}

InputFile::~InputFile() {
  if (fd_ >= 0) close(fd_);
}

size_t InputFile::ReadAt(uint64_t position, std::span<char> bytes) const {
  ssize_t n = -1;
  do {
    n = pread(fd_, bytes.data(), bytes.size(), static_cast<off_t>(position));
  } while (n < 0 && errno == EINTR);
  if (n < 0) Fail(errno);
  return static_cast<size_t>(n);
}

void InputFile::Fail(int error) const { ThrowFileError(fault_, error); }

std::string ReadInput(const std::filesystem::path& file, const std::string& what) {
  const InputFile input(file, what);
  std::string text;
  // Reading continues until the end of the file, because files may grow and files of /proc have size 0. The
  // first read requests one byte more than the size, so that it usually reaches the end.
  for (size_t room = input.size() + 1;; room = text.size() + (64 << 10)) {
    const size_t done = text.size();
    text.resize(std::max(room, done + 1));
    const size_t n = input.ReadAt(done, {text.data() + done, text.size() - done});
    text.resize(done + n);
    if (n == 0) return text;
  }
}

int64_t CountLines(const std::filesystem::path& file) {
  std::error_code unreadable;
  const auto kind = std::filesystem::status(file, unreadable).type();
  return kind == std::filesystem::file_type::not_found ? 0 : std::ranges::count(ReadInput(file), '\n');
}

std::ifstream OpenInput(const std::filesystem::path& file, const std::string& what) {
  const InputFile input(file, what);
  // Opening the descriptor's path opens the same file, even if the name now refers to another file.
  std::ifstream stream("/proc/self/fd/" + std::to_string(input.fd()), std::ios::binary);
  if (!stream) input.Fail(errno);
  return stream;
}

void CheckInput(const std::filesystem::path& file) { InputFile{file}; }

}  // namespace evalbus
