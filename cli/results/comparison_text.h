// A comparison for a terminal.
#pragma once

#include <string>

#include "cli/results/comparison.h"

namespace evalbus::results {

// Verdict, tables, what is left out. With `ratios`, effort relative to the baseline.
std::string ComparisonText(const Comparison& comparison, bool ratios);

}  // namespace evalbus::results
