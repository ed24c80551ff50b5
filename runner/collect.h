// Collects demonstrations, which are successful episodes from evenly spread starts (runner/strata.h).
// Evaluates rounds of episodes in one folder as `evalbus run` does, and finally removes the failures.
#pragma once

#include "runner/run_options.h"

namespace evalbus::runner {

// options.episodes: number of successes to collect. Prints the yield and writes OUT/collect.json. Throws
// InputError or EnvironmentError.
void Collect(RunOptions options);

}  // namespace evalbus::runner
