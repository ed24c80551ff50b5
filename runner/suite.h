// A suite, which consists of runs of several tasks and variations in one folder (docs/run_folder.md).
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/plan_layout.h"
#include "results/run_folder.h"
#include "results/run_summary.h"
#include "runner/job_pool.h"
#include "runner/json_events.h"
#include "runner/progress_line.h"
#include "runner/run_options.h"

namespace evalbus::runner {

// Expands names such as "all", "lift_pot/all" and "lift_pot/position", and RoboEval's names to
// TASK/VARIATION, in the given order. Task files keep their paths. Throws InputError for unknown or duplicate
// names, and for tasks that would have the same folder.
std::vector<std::string> ExpandTasks(const std::vector<std::string>& names);

// Evaluates one policy on several tasks in a folder, with one job per run.
class Suite {
 public:
  // Creates the folder and writes suite.json. Throws InputError or EnvironmentError.
  Suite(RunOptions options, const std::vector<std::string>& tasks);

  const std::vector<std::string>& tasks() const { return tasks_; }
  const results::RunFolder& folder() const { return folder_; }
  std::filesystem::path run_folder(const std::string& task) const {
    return folder_.path() / FolderOfTask(task);
  }
  // Returns one job per task, with the task's name. If output.json is true, their processes print the events
  // of their runs.
  std::vector<Job> Jobs(const RunOutput& output) const;
  // Must be called when the job of this task has succeeded; returns its results.
  const results::Tally& Ended(const std::string& task);
  const results::SuiteTally& tally() const { return tally_; }
  int num_done() const { return num_done_; }
  void WriteSummary() const { folder_.WriteJson(kSummaryJson, tally_.Json(tasks_)); }

 private:
  std::vector<std::string> tasks_;
  results::RunFolder folder_;
  results::SuiteTally tally_;
  int num_done_ = 0;
};

// Runs jobs, `at_once` at a time, shows their progress, and calls ended(name) after each success. Passes the
// events that they print to `events`, unless it is null. Returns false if a stop was requested.
bool RunJobs(std::vector<Job> jobs, int at_once, JobsProgress* progress, EventLines* events,
             const std::function<void(const std::string&)>& ended);

// Runs the tasks, at most options.workers at the same time. Throws InputError or EnvironmentError.
void RunSuite(RunOptions options, const std::vector<std::string>& tasks, const RunOutput& output);

}  // namespace evalbus::runner
