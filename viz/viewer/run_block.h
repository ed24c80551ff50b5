// What a page knows of runs beside their episodes' ticks: the blocks "run", "episodes" and "log" of
// docs/viewer_data.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "evalbus/episode_summary_t.hpp"
#include "evalbus/log_t.hpp"
#include "viz/watch/run_watch.h"

namespace evalbus::viz {

// Which run, in words that its messages do not say.
struct RunLabel {
  int run = 0;
  std::string name;
  std::string policy;
  // It goes on, or may; false of one that is read from disk.
  bool is_live = false;
  // A sentence each.
  std::vector<std::string> remarks;
};

// Of a run as its folder has it.
struct RunNumbers {
  std::string task, variation, clock;
  int planned = 0, done = 0, complete = 0, successes = 0;
  // 95 %, in shares; of a run that is over Wilson's, else that which holds at every look.
  double lower = 0, upper = 1;
  bool is_over = true;
  std::vector<std::pair<std::string, int64_t>> failure_reasons;
};

// now: as for RunWatch, which is brought up to it before. counted: what the run's folder says of its
// episodes, where it has one; it goes before RUN_SUMMARY, which may be of a part of them.
std::string RunBlock(const RunWatch& watch, const RunLabel& label, SteadyTime now,
                     const RunNumbers* counted = nullptr);
// Of a run that is not listened to.
std::string RunBlock(const RunNumbers& numbers, const RunLabel& label);

// A line of the list of episodes.
struct EpisodeRow {
  int episode = 0;
  int64_t seed = 0;
  std::string task, variation;
  std::string end_reason, failure_reason;
  bool success = false, complete = true;
  double time = 0;  // s
  std::string text;
  // Its ticks can be shown.
  bool has_track = true;
  // URL of a video, relative to the page; empty: none.
  std::string video;
};
EpisodeRow RowOf(const episode_summary_t& summary, const std::string& task, const std::string& variation);
// from: place of the first in the run's list.
std::string EpisodesBlock(int run, size_t from, const std::vector<EpisodeRow>& rows);

// A line, and when it came, as people read it ("14:03:07").
struct LogLine {
  log_t line;
  std::string time;
};
std::string LogBlock(int run, const std::vector<LogLine>& lines);

}  // namespace evalbus::viz
