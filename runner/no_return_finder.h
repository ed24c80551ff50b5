// Finds the point of no return of recorded episodes. Repeats an episode from its seed and the logged actions,
// and lets an expert take over at a tick that is found by bisection.
#pragma once

#include <memory>
#include <string>

#include "results/no_return.h"
#include "results/run_reader.h"

namespace evalbus::runner {

class NoReturnFinder {
 public:
  // Throws InputError if the run was not simulated in lockstep, its task has no expert, or its models differ
  // from this program's models. expert: the task whose expert takes over; empty: the task of the run.
  explicit NoReturnFinder(const results::RecordedRun& run, const std::string& expert = "");
  ~NoReturnFinder();
  NoReturnFinder(const NoReturnFinder&) = delete;
  NoReturnFinder& operator=(const NoReturnFinder&) = delete;

  // The episode must have failed. Throws InputError if its log is damaged, has no episode, or lacks ticks or
  // the end of the episode, or if the repeated states differ from the logged ones.
  results::NoReturn Find(int episode);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace evalbus::runner
