// A suite: runs of several tasks and variations, made together in one folder (docs/run_folder.md).
#pragma once

#include <string>
#include <vector>

#include "cli/launch/run_options.h"

namespace evalbus::launch {

// "all", "lift_pot/all", "lift_pot/position", RoboEval's names, files, in this order; each as TASK/VARIATION.
// Throws InputError for a name that does not exist, or one that is there twice.
std::vector<std::string> ExpandTasks(const std::vector<std::string>& names);

// Runs each of the tasks, options.workers at the same time. Throws InputError, EnvironmentError.
void RunSuite(RunOptions options, const std::vector<std::string>& tasks);

}  // namespace evalbus::launch
