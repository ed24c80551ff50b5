// Data of runs for the page, except ticks: the blocks "run", "episodes", "notes" and "log" of
// docs/viewer_data.md.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "evalbus/episode_summary_t.hpp"
#include "evalbus/log_t.hpp"
#include "viz/watch/run_watch.h"

namespace evalbus::viz {

// Facts about a run that its messages do not contain.
struct RunLabel {
  int run = 0;
  std::string name;
  std::string policy;
  // True if the run is or may be active. False if it is read from disk.
  bool is_live = false;
  // True if a process on this machine evaluates into the run's folder, with or without messages on a bus.
  bool is_active = false;
  // True if the run's folder was removed while it was shown.
  bool is_gone = false;
  // True if other runs on the page now contain the episodes of this run.
  bool is_replaced = false;
  // Remarks about the run, one line each.
  std::vector<std::string> remarks;
};

// Progress and results of a run, read from its folder.
struct RunNumbers {
  std::string task, variation, clock;
  // judged: number of complete episodes with a verdict, to which the success rate refers.
  int planned = 0, done = 0, complete = 0, judged = 0, successes = 0;
  // 95 % interval of the success rate, as shares from 0 to 1: the Wilson interval for a finished run,
  // otherwise an anytime-valid interval.
  double lower = 0, upper = 1;
  bool is_over = true;
  std::vector<std::pair<std::string, int64_t>> failure_reasons;
};

// Returns the "run" block. watch.Update(now) must have been called. counted: episode counts from the run
// folder, or null. They take precedence over RUN_SUMMARY, which may cover only some of the episodes.
std::string RunBlock(const RunWatch& watch, const RunLabel& label, SteadyTime now,
                     const RunNumbers* counted = nullptr);
// Returns the "run" block of a run without messages, e.g. a run that is read from disk.
std::string RunBlock(const RunNumbers& numbers, const RunLabel& label);

// An entry in the list of episodes.
struct EpisodeRow {
  int episode = 0;
  int64_t seed = 0;
  std::string task, variation;
  std::string end_reason, failure_reason;
  bool success = false, complete = true;
  double time = 0;  // s
  std::string text;
  // Decisive moment (docs/failures.md) and the sentence that explains it. The sentence is empty in runs of
  // versions before 0.3.
  double cause_time = 0;  // s
  std::string cause_text;
  // Counts of the episode; nullopt if the source does not provide what a count requires. stages: number of
  // stages that were reached.
  std::optional<int64_t> slips, grasps, collisions, stages;
  // True if the ticks of the episode can be shown.
  bool has_track = true;
  // URL of a video, relative to the page; empty if there is none.
  std::string video;
};
EpisodeRow RowOf(const episode_summary_t& summary, const std::string& task, const std::string& variation);
// Returns an "episodes" block. from: index of the first row in the run's list.
std::string EpisodesBlock(int run, size_t from, const std::vector<EpisodeRow>& rows);

// Returns a "notes" block. notes: text by episode. can_write: whether the page may change the notes.
std::string NotesBlock(int run, const std::map<int, std::string>& notes, bool can_write);

// A log line with its time of arrival as displayed ("14:03:07").
struct LogLine {
  log_t line;
  std::string time;
};
std::string LogBlock(int run, const std::vector<LogLine>& lines);

}  // namespace evalbus::viz
