// Runs the worker processes of `evalbus run`. Each worker evaluates a share of the episodes, or one run of a
// suite.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "runner/job_pool.h"
#include "runner/launch.h"

namespace evalbus::runner {

// Returns the command `evalbus run` with the options of a file; callers append the options that differ.
std::vector<std::string> RunCommand(const std::filesystem::path& options_file);

// Listener in a worker. Writes remarks to the worker's log, from which the launcher forwards them.
class WorkerLog : public RunListener {
 public:
  void OnRemark(const std::string& text) override;
};

// Runs the episodes as the functions in runner/launch.h do, but with n = options.workers workers at the same
// time. Worker k runs the episodes whose number leaves the remainder k when divided by n. A worker that is
// killed or hangs is restarted and resumes (JobPool::Poll). run.json must exist.
void EvaluateWorkers(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                     RunListener* listener);

// Runs jobs that write episodes into the folder, at most `at_once` at a time. Forwards these episodes and the
// remarks in the jobs' logs to the listener.
void EvaluateJobs(std::vector<Job> jobs, int at_once, const results::RunFolder& folder,
                  RunListener* listener);

// Returns the options of `evalbus run` that select these episodes: --only, repeated if there are many
// episodes, because the system limits the length of an argument.
std::vector<std::string> OnlyOptions(const std::vector<int>& episodes);

// Returns the episodes of worker `worker` (from 0) of `workers`.
std::vector<int> EpisodesOfWorker(const std::vector<int>& episodes, int worker, int workers);

}  // namespace evalbus::runner
