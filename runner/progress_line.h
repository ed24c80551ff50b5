// Shows the progress of a long command. If standard output is a terminal, a line is redrawn in place.
// Otherwise a line is printed on standard error every ten seconds, so that logs also contain it.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "runner/video_progress.h"

namespace evalbus::runner {

class ProgressLine {
 public:
  using Time = VideoProgress::Time;
  static constexpr std::chrono::milliseconds kInPlace{200};
  // Interval between lines. A command that takes less time prints none.
  static constexpr std::chrono::seconds kBetweenLines{10};

  // Shows, for example, "exporting 50 episodes: 24 %, 1:10 min left".
  ProgressLine(size_t episodes, std::string verb);
  // Constructor for tests.
  ProgressLine(size_t episodes, std::string verb, std::FILE* out, bool is_in_place, Time now);
  ~ProgressLine() { Clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  // Prints at most once per kInPlace or kBetweenLines, and must be called at least that often. done: number
  // of episodes, including fractions.
  void Show(double done) { Show(done, std::chrono::steady_clock::now()); }
  void Show(double done, Time now);
  // Erases the line. Must be called before anything else is printed.
  void Clear();

 private:
  size_t episodes_;
  std::string verb_;
  std::FILE* out_;
  bool is_in_place_, is_shown_ = false;
  Time last_;
  // Set by the first call of Show(). Episodes that were done earlier are not included in the estimate.
  std::optional<VideoProgress> progress_;
};

// Shows the progress of several jobs if standard output is a terminal, for example "3 of 9 runs, 17 of 72
// episodes, 23 s".
class JobsProgress {
 public:
  using Time = ProgressLine::Time;

  // what: the name of the jobs in the plural. runs: folders of runs with `episodes` episodes each, which are
  // counted; empty for other jobs.
  JobsProgress(size_t jobs, std::string what, const std::vector<std::filesystem::path>& runs = {},
               int episodes = 0);
  // Constructor for tests.
  JobsProgress(size_t jobs, std::string what, const std::vector<std::filesystem::path>& runs, int episodes,
               std::FILE* out, bool is_terminal, Time now);
  ~JobsProgress() { Clear(); }
  JobsProgress(const JobsProgress&) = delete;
  JobsProgress& operator=(const JobsProgress&) = delete;

  // Redraws the line at most once per ProgressLine::kInPlace. Must be called at least that often.
  void Show(size_t done) { Show(done, std::chrono::steady_clock::now()); }
  void Show(size_t done, Time now);
  // Erases the line. Must be called before anything else is printed.
  void Clear();

 private:
  struct CountedRun {
    std::filesystem::path lines;
    uintmax_t size = 0;
    int64_t episodes = 0;
  };
  int64_t CountEpisodes();

  size_t jobs_;
  std::string what_;
  std::vector<CountedRun> runs_;
  int episodes_;
  std::FILE* out_;
  bool is_terminal_, is_shown_ = false;
  Time began_, last_;
};

}  // namespace evalbus::runner
