// evalbus run: evaluates a policy on a task.
#pragma once

#include "cli/launch/run_options.h"

namespace CLI {
class App;
}

namespace evalbus::commands {

void AddRunOptions(CLI::App* app, launch::RunOptions* options);

// Returns the exit code. Throws InputError, EnvironmentError.
int Run(launch::RunOptions options);

}  // namespace evalbus::commands
