// The one place where input files are opened: files that users name, and files in folders that other
// processes write to. Only regular files are read. Anything else (a named pipe, a device, a socket) is
// refused before it is opened, since reading it, or only opening it, might never end.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace evalbus {

class InputFile {
 public:
  // Opens a file, or the target of a link, and never blocks. Throws InputError, one line with the reason:
  // "a.yaml: cannot be read: No such file or directory"; with `what`, "a.yaml: cannot read the contract:
  // ...".
  explicit InputFile(const std::filesystem::path& file, const std::string& what = "");
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  int fd() const { return fd_; }
  // Size in bytes when the file was opened.
  uint64_t size() const { return size_; }
  // Throws InputError as above, "a.yaml: cannot be read: Input/output error".
  [[noreturn]] void Fail(int error) const;

 private:
  // Text of errors before the reason.
  std::string fault_;
  int fd_ = -1;
  uint64_t size_ = 0;
};

// The whole file. Throws InputError.
std::string ReadInput(const std::filesystem::path& file, const std::string& what = "");

// A file to be read piece by piece. Throws InputError.
std::ifstream OpenInput(const std::filesystem::path& file, const std::string& what = "");

// For files that a library opens itself. Throws InputError.
void CheckInput(const std::filesystem::path& file);

}  // namespace evalbus
