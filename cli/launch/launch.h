// Runs the episodes of a plan, with one process per component or all components in this process. Both give
// equal bits. They return early, with what was finished, once a stop was requested (InstallStopSignals). They
// throw InputError and EnvironmentError; finished episodes are in the folder all the same.
#pragma once

#include "cli/launch/run_controller.h"
#include "cli/launch/run_options.h"

namespace evalbus::launch {

void EvaluateInProcess(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                       RunListener* listener);
void EvaluateProcesses(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                       RunListener* listener);

}  // namespace evalbus::launch
