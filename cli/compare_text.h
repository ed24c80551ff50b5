// A comparison for a terminal.
#pragma once

#include <string>

#include "cli/compare.h"

namespace evalbus {

// Verdict, tables, what is left out. With `ratios`, effort relative to the baseline.
std::string ComparisonText(const Comparison& comparison, bool ratios);

}  // namespace evalbus
