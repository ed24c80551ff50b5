// The one place where input files are opened: files that users name, and files in folders that other
// processes write to. Only regular files are read. Anything else (a named pipe, a device, a socket) is
// refused before it is opened, since reading it, or only opening it, might never end.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
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
  // Reads bytes from a position in the file, and returns how many: 0 at the end, otherwise at least one.
  // Throws as above, "a.yaml: cannot be read: Input/output error".
  size_t ReadAt(uint64_t position, std::span<char> bytes) const;
  // Throws the error of an operation on fd().
  [[noreturn]] void Fail(int error) const;

 private:
  // Text of errors before the reason.
  std::string fault_;
  int fd_ = -1;
  uint64_t size_ = 0;
};

// The whole file. Throws as above.
std::string ReadInput(const std::filesystem::path& file, const std::string& what = "");

// Number of complete lines; 0 if the file does not exist. Throws as above.
int64_t CountLines(const std::filesystem::path& file);

// To be read piece by piece. Not for lines: a failed read looks like the end of the file. Throws as above.
std::ifstream OpenInput(const std::filesystem::path& file, const std::string& what = "");

// For files that a library opens itself. Throws as above.
void CheckInput(const std::filesystem::path& file);

}  // namespace evalbus
