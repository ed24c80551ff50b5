// Episodes as comma-separated values (RFC 4180, with plain line feeds).
#pragma once

#include <string>
#include <vector>

#include "cli/results/run_reader.h"

namespace evalbus::results {

// A row for each finished episode, also those that are not complete: run, policy (as --policy took
// it), policy_name (what results call it), task, variation, robot, control_hz, evalbus_version, episode,
// seed, end_reason, failure_reason, complete (0 or 1), then every number of the results by its flattened
// name, empty where the episode does not have it. Numbers keep all their digits.
std::string EpisodeTable(const std::vector<RecordedRun>& runs);

}  // namespace evalbus::results
