// Collects demonstrations: successes only, from starts that are spread evenly (cli/launch/strata.h). Runs of
// `evalbus run` in one folder, whose failures are taken away at the end.
#pragma once

#include "cli/launch/run_options.h"

namespace evalbus::launch {

// options.episodes: how many are wanted. Says the yield, writes OUT/collect.json. Throws InputError,
// EnvironmentError.
void Collect(RunOptions options);

}  // namespace evalbus::launch
