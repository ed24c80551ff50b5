// The folder of a run, as described in docs/run_folder.md. Results are appended to episodes.jsonl and synced
// line by line. JSON files are written under a temporary name and renamed, so that they are never incomplete.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/run_layout.h"

namespace evalbus::results {

// Returns runs/NAME-DATE-TIME.
std::filesystem::path DatedFolder(const std::string& name);

// Reads the lines of a file that may still be growing.
class NewLines {
 public:
  explicit NewLines(std::filesystem::path file) : file_(std::move(file)) {}
  // Returns the lines completed since the last call. An incomplete last line is left for a later call.
  std::vector<std::string> Next();
  const std::filesystem::path& file() const { return file_; }

 private:
  std::filesystem::path file_;
  uint64_t position_ = 0;  // position of the first byte that was not returned
};

// Reads the lines of an episodes.jsonl that may still be growing.
class EpisodeLines {
 public:
  explicit EpisodeLines(std::filesystem::path file) : lines_(std::move(file)) {}
  // Throws InputError with file and line.
  std::vector<nlohmann::ordered_json> Next();

 private:
  NewLines lines_;
  int line_ = 0;
};

// Returns whether a process on this machine is evaluating this run or suite, or the suite to which this run
// belongs. Never waits.
bool IsInUse(const std::filesystem::path& folder);

class RunFolder {
 public:
  // Creates the folder `out`, or runs/NAME-DATE-TIME if `out` is empty. With `resume`, the existing folder of
  // an interrupted run is opened. Throws InputError if the folder is not empty and `resume` is false or there
  // is nothing to resume, or if another `evalbus run` uses it. If it cannot be created, throws InputError or
  // EnvironmentError (base/file_errors.h).
  static RunFolder OfRun(const std::filesystem::path& out, const std::string& name, bool resume) {
    return RunFolder(out, name, resume, kRunJson);
  }
  // Creates or opens the folder of a suite, with the rules and errors of OfRun().
  static RunFolder OfSuite(const std::filesystem::path& out, const std::string& name, bool resume) {
    return RunFolder(out, name, resume, kSuiteJson);
  }
  // Opens the folder in a worker of the run that created it.
  static RunFolder OfWorker(const std::filesystem::path& folder);
  RunFolder(RunFolder&& other) noexcept
      : path_(std::move(other.path_)), made_(std::move(other.made_)), lock_(std::exchange(other.lock_, -1)) {}
  ~RunFolder();

  const std::filesystem::path& path() const { return path_; }
  // Returns the path for display: relative if it is below the current folder.
  std::filesystem::path shown() const;
  std::filesystem::path log_file(const std::string& component) const { return LogFile(path_, component); }

  // The functions below throw the errors of WriteWhole() if writing fails. They remove only files and folders
  // that evalbus created.

  void WriteJson(const std::string& name, const nlohmann::ordered_json& json) const;
  // Writes episodes/0007/policy_calls.json.
  void AddPolicyCalls(int episode, const nlohmann::ordered_json& calls) const;
  // Writes episodes/0007/summary.json and then appends the line to episodes.jsonl.
  void AddEpisode(int episode, const nlohmann::ordered_json& result) const;
  // Rewrites episodes.jsonl in the order of `results`, because workers finish episodes in a different order.
  void WriteEpisodes(const std::vector<nlohmann::ordered_json>& results) const;
  // Removes the files of an unfinished attempt of an episode.
  void DiscardEpisode(int episode) const;
  // Removes the leftovers of an interrupted run: all episodes except `finished`, and partially written files.
  void DiscardAllBut(const std::set<int>& finished) const;
  // Removes partially written files; the processes that wrote them must have ended. Videos are kept, because
  // one may still be being recorded.
  void RemoveHalfWritten() const;
  // Removes all partially written videos or, if `by` is set, only the videos of this process.
  void RemoveHalfWrittenVideos(std::optional<pid_t> by = std::nullopt) const;
  // Removes the run's files, unless an episode has finished.
  void Remove() const;

 private:
  RunFolder() = default;
  // `mark`: the file that identifies such a folder, for example run.json.
  RunFolder(const std::filesystem::path& out, const std::string& name, bool resume, const std::string& mark);

  std::filesystem::path path_;
  // Folders that were created for this run, the deepest last.
  std::vector<std::filesystem::path> made_;
  // Lock on the folder. The processes of a run end with the process that holds the lock, so a run cannot be
  // resumed while its old recorder is still writing.
  int lock_ = -1;
};

// Lock for the files of a run that several programs change: notes.json, verdicts.jsonl and no_return.json.
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
