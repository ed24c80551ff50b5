// A temporary folder on this machine's local disk.
#pragma once

#include <filesystem>

namespace evalbus {

class Scratch {
 public:
  // Creates TMPDIR/evalbus-PROCESS-XXXXXX. Before a process creates its first folder, it removes the folders
  // of processes that were killed. Throws InputError or EnvironmentError.
  Scratch();
  // Removes the folder.
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  // File descriptor with a lock that is held as long as this object exists.
  int fd_ = -1;
};

// Returns the folder that TMPDIR names; without TMPDIR, usually /tmp. Throws InputError or EnvironmentError,
// with the name of the variable, if it is not a folder.
std::filesystem::path FolderOfTemporaryFiles();

// Removes from `folder` the temporary folders of this user's processes that have ended without removing them.
void RemoveAbandonedScratch(const std::filesystem::path& folder);

}  // namespace evalbus
