// Checks whether two runs can be compared, and what besides the policy differs between them.
#pragma once

#include <string>

#include "results/run_reader.h"

namespace evalbus::results {

// Throws InputError if values of the two runs have different meanings: different control rate, task
// description or physics model.
void CheckComparable(const RecordedRun& run, const RecordedRun& baseline);

// Describes all other differences in configuration that may change values, for example "realtime true against
// false"; empty if there are none.
std::string MadeDifferently(const RecordedRun& run, const RecordedRun& baseline);

}  // namespace evalbus::results
