// A temporary folder on this machine's local disk.
#pragma once

#include <filesystem>

namespace evalbus {

class Scratch {
 public:
  // Creates TMPDIR/evalbus-PROCESS-XXXXXX. Before the first one, a process removes those of processes that
  // were killed. Throws InputError, EnvironmentError.
  Scratch();
  // Removes the folder.
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  // Locked as long as this object exists.
  int fd_ = -1;
};

// Removes from `folder` the temporary folders of this user's processes that have ended without their
// destructors.
void RemoveAbandonedScratch(const std::filesystem::path& folder);

}  // namespace evalbus
