// Files that are there are whole: written under a temporary name of this process's own, synced, renamed.
#pragma once

#include <sys/stat.h>
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>

namespace evalbus {

// Writes a file. One that exists is replaced and keeps its permissions, and its owner where we may give files
// away; a link is followed; a pipe, a device, or what is open in this process (/dev/stdout) is written to as
// it is. On failure nothing is left behind and what was there stays. Throws InputError where the name is
// wrong (no such folder, no permission, a folder), else EnvironmentError.
void WriteWhole(const std::filesystem::path& file, const std::string& text);

// The same for a file that a library writes, or that is too large for memory: write to path(), close it, call
// Finish().
class WholeFile {
 public:
  // Throws InputError also for what is no file: a pipe, a device.
  explicit WholeFile(std::filesystem::path file);
  // Removes what was written unless it was finished.
  ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  // Temporary name beside the file.
  const std::filesystem::path& path() const { return temporary_; }
  // Syncs what was written and gives it its name. Throws InputError, EnvironmentError.
  void Finish();

 private:
  std::filesystem::path file_, target_, temporary_;
  // What is to be replaced.
  struct stat before_ {};
  bool exists_ = false, is_finished_ = false;
};

// Name under which a process writes a file, and under which a killed process leaves it half-written:
// "summary.json.node7-4711.tmp". Older versions wrote "summary.json.4711.tmp".
struct TemporaryName {
  std::string file;
  // As ThisProcess() names it; of older versions only the process id.
  std::string process;
  pid_t pid = 0;
};
// Returns nothing for other names.
std::optional<TemporaryName> ParseTemporaryName(const std::string& name);

}  // namespace evalbus
