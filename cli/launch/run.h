// A whole `evalbus run`: from options to results, videos and the table at the end.
#pragma once

#include "cli/launch/run_options.h"

namespace evalbus::launch {

// Runs what options.tasks name: a run, or a suite of several. Throws InputError, EnvironmentError.
void Run(RunOptions options);

// The same where somebody else moves the robot (`evalbus watch`): options.url is where its source is heard. A
// stop by the user is an end like any other.
void Watch(RunOptions options);

// A worker's part of a run that another process has prepared (options.worker): its episodes only.
void RunWorker(RunOptions options);

}  // namespace evalbus::launch
