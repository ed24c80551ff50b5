// Reads the episodes and rates of a run folder incrementally, while the run may still be active.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "metrics/statistics/run_statistics.h"
#include "results/run_folder.h"
#include "results/run_reader.h"
#include "viz/viewer/run_block.h"

namespace evalbus::report {

class RunFollower {
 public:
  // Follows the run in `folder`. The folder and its files need not exist yet.
  explicit RunFollower(std::filesystem::path folder);

  // The rows of the list of episodes from index `from` to its end, in the order of episodes.jsonl. is_changed
  // is also set if only rates or properties of the run have changed.
  struct News {
    bool is_changed = false;
    size_t from = 0;
    std::vector<viz::EpisodeRow> rows{};
  };
  // Reads at most kLinesAtOnce new lines; the next call continues.
  static constexpr size_t kLinesAtOnce = 200;
  News Update();

  const std::filesystem::path& folder() const { return folder_; }
  // Returns the run; null until run.json exists. Its `episodes` are the episodes read so far, without their
  // text. Its `info` contains the hash of the physics model if the model could be read.
  const results::RecordedRun* info() const { return info_ ? &*info_ : nullptr; }
  // Returns the names of the stages, by index.
  const std::map<int, std::string>& stage_names() const { return stage_names_; }
  // Returns the numbers of the run as of the last Update(). While Update() has more lines to read, they may
  // cover fewer episodes.
  const viz::RunNumbers& numbers() const { return numbers_; }
  // Returns true if summary.json exists, all lines have been read, and no planned episode is missing, unless
  // the run may end early or is a collection. A run that was interrupted also has a summary.
  bool is_over() const { return numbers_.is_over; }
  // Returns a description of an error in the run's files in one line; empty if there is none.
  const std::string& error() const { return error_; }

 private:
  std::filesystem::path File() const { return folder_ / kEpisodesJsonl; }
  // Returns false if episodes.jsonl was removed, or replaced by a file that does not start with the lines
  // that were processed.
  bool ReadLines();
  bool IsFinished() const;
  void ReadInfo();
  void SetModel();
  void StartAgain();

  std::filesystem::path folder_;
  std::optional<results::RecordedRun> info_;
  std::filesystem::file_time_type info_time_{};
  results::NewLines lines_;
  uint64_t inode_ = 0;
  // waiting_: lines that were read; the lines starting at next_waiting_ have not been processed yet. hashes_:
  // hash of each processed line.
  std::vector<std::string> waiting_;
  size_t next_waiting_ = 0;
  std::vector<size_t> hashes_;
  metrics::RunStatistics statistics_;
  std::map<int, std::string> stage_names_;
  viz::RunNumbers numbers_;
  std::string error_;
};

}  // namespace evalbus::report
