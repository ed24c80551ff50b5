// Formats comparisons as text for a terminal.
#pragma once

#include <limits>
#include <string>

#include "results/comparison.h"

namespace evalbus::results {

// Returns the conclusion, the tables and the remarks. With `ratios`, effort metrics are also shown relative
// to the baseline if there is only one task. colors: see base/styled_text.h. If the tables do not fit into
// `width`, names are shortened and columns omitted; a line names these columns. Sentences are wrapped.
std::string ComparisonText(const Comparison& comparison, bool ratios, bool colors = false,
                           int width = std::numeric_limits<int>::max());
// Returns Headline() and Evidence() (results/conclusion.h) on separate lines, wrapped at `width`.
std::string ConclusionText(const Comparison& comparison, int width, bool colors);

// Returns name and policy, for example "ckpt-12000 (pi0)", or only "expert" if they are equal.
std::string NameAndPolicy(const ComparedRuns& runs);

// Formats p with three decimals. Halves are rounded up, as in viz/viewer/page/dom.js: 0.0625, a frequent p of
// exact tests, gives "0.063". Values below 0.001 give "<0.001". 0.04996 gives "0.0499", because "0.050" would
// look not significant.
std::string PText(double p);
// Formats p as "p = 0.002" or "p < 0.001".
std::string PEquals(double p);

}  // namespace evalbus::results
