// Other processes of `evalbus run` that do parts of a run: a share of its episodes each, or a run of a suite.
#pragma once

#include <string>
#include <vector>

#include "cli/launch/launch.h"

namespace evalbus::launch {

// The command that evaluates as `options` say; which tasks, where to and with how many workers is left to
// add.
std::vector<std::string> RunCommand(const RunOptions& options);

// A worker's part of `listener` below: what it remarks stands in its log, from where the launcher passes it
// on.
class WorkerLog : public RunListener {
 public:
  void OnRemark(const std::string& text) override;
};

// Like EvaluateInProcess: runs plan.episodes with options.workers workers at the same time, each of which
// takes every so manieth episode. A worker that dies goes on where it was.
void EvaluateWorkers(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                     RunListener* listener);

// Of these episodes the ones of a worker's share, "1/4" for the second of four.
std::vector<int> EpisodesOfShare(const std::vector<int>& episodes, const std::string& share);

}  // namespace evalbus::launch
