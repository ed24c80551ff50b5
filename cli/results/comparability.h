// Which runs can be compared, and what besides the policy may have made them differ.
#pragma once

#include <string>

#include "cli/results/run_reader.h"

namespace evalbus::results {

// Throws InputError where values of the two runs mean different things: other control rate, task description
// or physics model.
void CheckComparable(const RecordedRun& run, const RecordedRun& baseline);

// How else they were made differently, of what may change values: "realtime true against false"; empty where
// there is nothing.
std::string MadeDifferently(const RecordedRun& run, const RecordedRun& baseline);

}  // namespace evalbus::results
