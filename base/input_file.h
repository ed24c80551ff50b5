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
  // Opens a file, or the target of a link, and never blocks. Throws InputError, or EnvironmentError if the
  // machine is the cause, in one line: "a.yaml: cannot be read: No such file or directory"; with `what`,
  // "a.yaml: cannot read the contract: ...".
  explicit InputFile(const std::filesystem::path& file, const std::string& what = "");
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  int fd() const { return fd_; }
  // Size in bytes when the file was opened.
  uint64_t size() const { return size_; }
  // Throws as above, "a.yaml: cannot be read: Input/output error".
  [[noreturn]] void Fail(int error) const;

 private:
  // Text of errors before the reason.
  std::string fault_;
  int fd_ = -1;
  uint64_t size_ = 0;
};

// The whole file. Throws as above.
std::string ReadInput(const std::filesystem::path& file, const std::string& what = "");

// To be read piece by piece. Not for lines: a failed read looks like the end of the file. Throws as above.
std::ifstream OpenInput(const std::filesystem::path& file, const std::string& what = "");

// For files that a library opens itself. Throws as above.
void CheckInput(const std::filesystem::path& file);

}  // namespace evalbus
