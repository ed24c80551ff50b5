// Opens input files: files that users name, and files in folders that other processes write to.
// Only regular files are read. Anything else (a named pipe, a device, a socket) is refused before it is
// opened, because reading it, or even opening it, might block forever.
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
  // Returns the size in bytes that the file had when it was opened.
  uint64_t size() const { return size_; }
  // Reads bytes from a position in the file. Returns their number: 0 at the end of the file, otherwise at
  // least 1. Throws the errors of the constructor, such as "a.yaml: cannot be read: Input/output error".
  size_t ReadAt(uint64_t position, std::span<char> bytes) const;
  // Throws the error of an operation on fd().
  [[noreturn]] void Fail(int error) const;

 private:
  // Beginning of error texts, before the reason.
  std::string fault_;
  int fd_ = -1;
  uint64_t size_ = 0;
};

// Returns the contents of a file. This function and the following ones throw the errors of InputFile.
std::string ReadInput(const std::filesystem::path& file, const std::string& what = "");

// Returns the number of complete lines; 0 if the file does not exist.
int64_t CountLines(const std::filesystem::path& file);

// Opens a file that is read piece by piece. Must not be used for reading lines, because a failed read looks
// like the end of the file.
std::ifstream OpenInput(const std::filesystem::path& file, const std::string& what = "");

// Checks a file that a library opens itself.
void CheckInput(const std::filesystem::path& file);

}  // namespace evalbus
