// Lock for the files of a run that several programs change: notes.json, verdicts.jsonl and no_return.json.
#pragma once

#include <filesystem>

namespace evalbus::results {

// Must be held while such a file is read, changed and replaced, so that no change of another process or
// thread is lost. The constructor waits until the lock is free. It locks the folder `episodes`, because an
// active run locks its own folder until it ends.
class RunFilesLock {
 public:
  // Throws InputError or EnvironmentError if the run has no folder `episodes`, or if it cannot be locked.
  explicit RunFilesLock(const std::filesystem::path& run);
  ~RunFilesLock();
  RunFilesLock(const RunFilesLock&) = delete;
  RunFilesLock& operator=(const RunFilesLock&) = delete;

 private:
  int fd_;
};

}  // namespace evalbus::results
