// Detects whether a policy commanded any motion. A success without a commanded motion is not an achievement
// of the policy.
#pragma once

#include "results/run_reader.h"

namespace evalbus::results {

// Returns true if the log of any episode contains a command (ACTION) that differs from the episode's first
// command: a joint target by more than 1 mrad, or a gripper by more than 0.1 % of its opening. Reads logs
// until it finds such a command, usually only the beginning of the first log. False if the logs are missing.
// Throws InputError if a log cannot be read.
bool ShowsCommandedMotion(const RecordedRun& run);

}  // namespace evalbus::results
