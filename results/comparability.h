// Checks whether two runs can be compared, and lists what differs between them besides the policy.
#pragma once

#include <string>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::results {

// Throws InputError if values of the two runs have different meanings: different control rate, task
// description or physics model. Also throws it if a run.json lacks one of these.
void CheckComparable(const RecordedRun& run, const RecordedRun& baseline);

// Throws InputError if two of the runs were simulated by different versions of MuJoCo. External sources and
// runs that do not name their version are not checked.
void CheckSameEngine(const std::vector<const RecordedRuns*>& runs);

// Returns a description of the other differences in configuration that may change values, for example
// "realtime true against false"; empty if there are none. Keys that only one of the runs has are not
// compared, and at most four differences of the contracts are listed.
std::string MadeDifferently(const RecordedRun& run, const RecordedRun& baseline);

}  // namespace evalbus::results
