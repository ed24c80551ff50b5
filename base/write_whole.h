// Atomic file writes: a file is written under a temporary name, synced, and renamed.
#pragma once

#include <sys/stat.h>
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>

namespace evalbus {

// Writes a file. An existing file is replaced; it keeps its permissions, and its owner if this process may
// change owners. Links are followed. A pipe, a device, or a file that is open in this process (/dev/stdout)
// is written to directly. For any other file, the previous contents remain on failure, and no temporary file
// is left. Throws InputError if the name is wrong (no such folder, no permission, a folder), otherwise
// EnvironmentError.
void WriteWhole(const std::filesystem::path& file, const std::string& text);

// Atomically writes a file that a library writes, or that is too large for memory. The caller writes to
// path(), closes it, and calls Finish().
class WholeFile {
 public:
  // Throws the errors of WriteWhole(), and InputError for pipes and devices.
  explicit WholeFile(std::filesystem::path file);
  // Removes the temporary file unless Finish() has succeeded.
  ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  // Returns the path of the temporary file, which is in the folder of the final file.
  const std::filesystem::path& path() const { return temporary_; }
  // Syncs the temporary file and renames it. Throws InputError or EnvironmentError.
  void Finish();

 private:
  std::filesystem::path file_, target_, temporary_;
  // Status of the file that is replaced.
  struct stat before_ {};
  bool exists_ = false, is_finished_ = false;
};

// Temporary name under which a process writes a file: "summary.json.node7-4711.tmp". A killed process leaves
// an incomplete file with this name. Older versions wrote "summary.json.4711.tmp".
struct TemporaryName {
  std::string file;
  // Name of the process as returned by ThisProcess(); in names written by older versions, only the process
  // id.
  std::string process;
  pid_t pid = 0;
};
// Parses a temporary name. Returns nullopt for other names.
std::optional<TemporaryName> ParseTemporaryName(const std::string& name);

}  // namespace evalbus
