// Formats episodes as comma-separated values (RFC 4180, but lines end with LF).
#pragma once

#include <string>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::exports {

// Returns a row for each finished episode, including incomplete ones. Columns: run, policy (value of
// --policy), policy_name (name in the results), task, variation, robot, control_hz, evalbus_version, episode,
// seed, end_reason, failure_reason, complete (0 or 1), seen_in_training (only if an episode has it), every
// number of the results by its flattened name (empty if the episode does not have it), the verdicts of
// operators, and note (only if there are notes). Numbers have full precision. Throws InputError if
// verdicts.jsonl cannot be read.
std::string EpisodeTable(const std::vector<results::RecordedRun>& runs);

}  // namespace evalbus::exports
