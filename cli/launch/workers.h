// Other processes of `evalbus run` that do parts of a run: a share of its episodes each, or a run of a suite.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/launch/job_pool.h"
#include "cli/launch/launch.h"

namespace evalbus::launch {

// `evalbus run` with the options of a file; what is to differ is left to add.
std::vector<std::string> RunCommand(const std::filesystem::path& options_file);

// A worker's part of `listener` below: what it remarks stands in its log, from where the launcher passes it
// on.
class WorkerLog : public RunListener {
 public:
  void OnRemark(const std::string& text) override;
};

// Like EvaluateInProcess: runs plan.episodes with options.workers workers at the same time, each of which
// takes every so manieth episode. A worker that dies goes on where it was. run.json must have been written.
void EvaluateWorkers(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                     RunListener* listener);

// Runs jobs, so many at a time, that write episodes into the folder; tells the listener of these and of what
// the jobs' logs remark.
void EvaluateJobs(std::vector<Job> jobs, int at_once, const results::RunFolder& folder,
                  RunListener* listener);

// Of these episodes the ones of one of so many workers, counted from 0.
std::vector<int> EpisodesOfWorker(const std::vector<int>& episodes, int worker, int workers);

}  // namespace evalbus::launch
