// A suite: runs of several tasks and variations, made together in one folder (docs/run_folder.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/launch/job_pool.h"
#include "cli/launch/run_options.h"
#include "cli/results/run_folder.h"
#include "cli/results/run_summary.h"

namespace evalbus::launch {

// "all", "lift_pot/all", "lift_pot/position", RoboEval's names, files, in this order; each as TASK/VARIATION.
// Throws InputError for a name that does not exist, or one that is there twice.
std::vector<std::string> ExpandTasks(const std::vector<std::string>& names);

// What a task's run is called in the folder of its suite.
std::string FolderOfTask(std::string task);

// The runs of one policy on several tasks, in a folder: one job for each.
class Suite {
 public:
  // Makes the folder and writes suite.json. Throws InputError, EnvironmentError.
  Suite(RunOptions options, const std::vector<std::string>& tasks);

  const std::vector<std::string>& tasks() const { return tasks_; }
  const results::RunFolder& folder() const { return folder_; }
  std::filesystem::path run_folder(const std::string& task) const {
    return folder_.path() / FolderOfTask(task);
  }
  // Named as the tasks.
  std::vector<Job> Jobs() const;
  // The job of this task has ended well.
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

// Runs each of the tasks, options.workers at the same time. Throws InputError, EnvironmentError.
void RunSuite(RunOptions options, const std::vector<std::string>& tasks);

}  // namespace evalbus::launch
