// Comparisons as text for a terminal.
#pragma once

#include <string>

#include "results/comparison.h"

namespace evalbus::results {

// Returns the conclusion, the tables and the remarks. With `ratios`, effort metrics are also shown relative
// to the baseline. colors: as in base/styled_text.h.
std::string ComparisonText(const Comparison& comparison, bool ratios, bool colors = false);

// "ckpt-12000 (pi0)", or "expert" if name and policy are equal.
std::string NameAndPolicy(const ComparedRuns& runs);

// "0.063" of 0.0625, a frequent p value of exact tests: halves up, as in viz/viewer/page/dom.js. "<0.001"
// below; "0.0499" of 0.04996, because 0.050 would not be significant.
std::string PText(double p);
// "p = 0.002", "p < 0.001".
std::string PEquals(double p);

}  // namespace evalbus::results
