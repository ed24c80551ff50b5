// Functions that run the episodes of a run, with one process per component or with all components in this
// process. In lockstep, both give bit-identical results. They return early after a stop was requested
// (InstallStopSignals). They throw InputError and EnvironmentError; finished episodes are in the folder even
// then.
#pragma once

#include "runner/run_controller.h"
#include "runner/run_options.h"

namespace evalbus::runner {

void EvaluateInProcess(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                       RunListener* listener);
void EvaluateProcesses(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                       RunListener* listener);

}  // namespace evalbus::runner
