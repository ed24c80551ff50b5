// Collects demonstrations: successes only, from evenly spread starts (runner/strata.h). Executes runs of
// `evalbus run` in one folder and removes the failures at the end.
#pragma once

#include "runner/run_options.h"

namespace evalbus::runner {

// options.episodes: number of successes to collect. Prints the yield and writes OUT/collect.json. Throws
// InputError, EnvironmentError.
void Collect(RunOptions options);

}  // namespace evalbus::runner
