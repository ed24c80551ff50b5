// A run on disk that may still grow: its list of episodes and its rates, read a little at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/results/run_folder.h"
#include "cli/results/run_reader.h"
#include "metrics/statistics/run_statistics.h"
#include "viz/viewer/run_block.h"

namespace evalbus::results {

class RunFollower {
 public:
  // The folder, or what is in it, need not be there yet.
  explicit RunFollower(std::filesystem::path folder);

  // Rows of the list from `from` on, in the order of episodes.jsonl; is_changed also where rates or facts of
  // the run have changed.
  struct News {
    bool is_changed = false;
    size_t from = 0;
    std::vector<viz::EpisodeRow> rows{};
  };
  // Reads what is new, at most kLinesAtOnce lines: the rest at the next call.
  static constexpr size_t kLinesAtOnce = 200;
  News Look();

  const std::filesystem::path& folder() const { return folder_; }
  // Null until run.json is there.
  const RecordedRun* info() const { return info_ ? &*info_ : nullptr; }
  // Brought up to date by Look().
  const viz::RunNumbers& numbers() const { return numbers_; }
  // summary.json is there: nobody works on it.
  bool is_over() const { return numbers_.is_over; }
  // What is wrong with its files, one line; empty: nothing.
  const std::string& error() const { return error_; }

 private:
  std::filesystem::path File() const { return folder_ / kEpisodesJsonl; }
  // False where episodes.jsonl is another file than it was, which does not begin as that did.
  bool ReadLines();
  void StartAgain();
  void Count();

  std::filesystem::path folder_;
  std::optional<RecordedRun> info_;
  std::filesystem::file_time_type info_time_{};
  NewLines lines_;
  uint64_t inode_ = 0;
  // Lines that were read and not yet looked at; of all that were, what they hash to.
  std::vector<std::string> waiting_;
  size_t next_waiting_ = 0;
  std::vector<size_t> hashes_;
  metrics::RunStatistics statistics_;
  viz::RunNumbers numbers_;
  std::string error_;
};

}  // namespace evalbus::results
