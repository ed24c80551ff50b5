// Implements `evalbus run`: evaluates the episodes, records videos, and prints the final table.
#pragma once

#include "runner/json_events.h"
#include "runner/run_options.h"

namespace evalbus::runner {

// Evaluates the tasks in options.tasks as a single run or a suite. Throws InputError or EnvironmentError.
void Run(RunOptions options, const RunOutput& output = {});

// Implements `evalbus watch`, which evaluates episodes of an external system. options.url: the bus of its
// source. A stop by the user is a regular end. Throws InputError or EnvironmentError.
void Watch(RunOptions options);

// Evaluates the episodes of worker options.worker in a run that another process has prepared.
void RunWorker(RunOptions options);

}  // namespace evalbus::runner
