// The folder of a run, as docs/run_folder.md describes it. A file that is there is whole: results are
// appended and synced line by line, everything else is written under another name and renamed.
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

// Reads the lines of a file that may still grow.
class NewLines {
 public:
  explicit NewLines(std::filesystem::path file) : file_(std::move(file)) {}
  // Those that were finished since the last call. A last line without its end is being written and left for
  // later.
  std::vector<std::string> Next();
  const std::filesystem::path& file() const { return file_; }

 private:
  std::filesystem::path file_;
  std::streamoff position_ = 0;
};

// The same of an episodes.jsonl.
class EpisodeLines {
 public:
  explicit EpisodeLines(std::filesystem::path file) : lines_(std::move(file)) {}
  // Throws InputError that names file and line.
  std::vector<nlohmann::ordered_json> Next();

 private:
  NewLines lines_;
  int line_ = 0;
};

class RunFolder {
 public:
  // The folder `out`, or where that is empty a new one, runs/NAME-DATE-TIME. Creates it; with `resume` one
  // that exists is opened again, as it is. Throws InputError if it exists and is neither empty nor to be
  // resumed, if another `evalbus run` works in it, or if it cannot be made.
  static RunFolder OfRun(const std::filesystem::path& out, const std::string& name, bool resume) {
    return RunFolder(out, name, resume, kRunJson);
  }
  // The folder of a suite, likewise.
  static RunFolder OfSuite(const std::filesystem::path& out, const std::string& name, bool resume) {
    return RunFolder(out, name, resume, kSuiteJson);
  }
  // The same folder for a worker of the run that opened it.
  static RunFolder OfWorker(const std::filesystem::path& folder);
  RunFolder(RunFolder&& other) noexcept
      : path_(std::move(other.path_)), made_(std::move(other.made_)), lock_(std::exchange(other.lock_, -1)) {}
  ~RunFolder();

  const std::filesystem::path& path() const { return path_; }
  // For people: relative where it is below the current folder.
  std::filesystem::path shown() const;
  std::filesystem::path log_file(const std::string& component) const { return LogFile(path_, component); }

  // The functions below throw EnvironmentError where the disk refuses. What they remove are files and folders
  // of ours; what else somebody has put into the folder stays.

  void WriteJson(const std::string& name, const nlohmann::ordered_json& json) const;
  // Writes episodes/0007/policy_calls.json.
  void AddPolicyCalls(int episode, const nlohmann::ordered_json& calls) const;
  // Writes episodes/0007/summary.json and then appends the line to episodes.jsonl.
  void AddEpisode(int episode, const nlohmann::ordered_json& result) const;
  // Writes episodes.jsonl anew, in this order: several workers finish episodes in another one.
  void WriteEpisodes(const std::vector<nlohmann::ordered_json>& results) const;
  // Removes what an unfinished attempt of an episode left.
  void DiscardEpisode(int episode) const;
  // Removes what an interrupted run left half-done: all episodes but these, and what is half-written.
  void DiscardAllBut(const std::set<int>& finished) const;
  // Removes what processes that are gone left half-written; somebody may still be recording.
  void RemoveHalfWritten() const;
  // Videos likewise, all or those of one process.
  void RemoveHalfWrittenVideos(std::optional<pid_t> by = std::nullopt) const;
  // Takes the run away, unless an episode was finished: what has none is not a run.
  void Remove() const;

 private:
  RunFolder() = default;
  // `mark`: the file by which a folder of this kind is known.
  RunFolder(const std::filesystem::path& out, const std::string& name, bool resume, const std::string& mark);

  std::filesystem::path path_;
  // Folders that were made for it, the deepest last.
  std::vector<std::filesystem::path> made_;
  // Held while the folder is ours. Our child processes inherit it: it goes with the last of them, however
  // that ends, so that nobody goes on with a run whose recorder still writes.
  int lock_ = -1;
};

}  // namespace evalbus::results
