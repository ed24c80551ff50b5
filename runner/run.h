// Implements `evalbus run`: from options to results, videos and the final table.
#pragma once

#include "runner/json_events.h"
#include "runner/run_options.h"

namespace evalbus::runner {

// Runs the tasks in options.tasks: a single run, or a suite. Throws InputError, EnvironmentError.
void Run(RunOptions options, const RunOutput& output = {});

// Implements `evalbus watch`, which evaluates episodes of an external system. options.url: the bus of its
// source. A stop by the user is a regular end. Throws InputError, EnvironmentError.
void Watch(RunOptions options);

// Runs a worker's episodes of a run that another process has prepared (options.worker).
void RunWorker(RunOptions options);

}  // namespace evalbus::runner
