// States the result of a comparison in sentences.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "results/comparison.h"

namespace evalbus::results {

// Returns the result without a period, for example "B is 24 points better than A, 95 % CI 8 to 39".
std::string Headline(const Comparison& comparison);
// Returns the results of comparisons with one baseline, for example "a and b are better than c; d is not
// shown to differ from c". For one comparison, returns its headline; for none, an empty string.
std::string Headline(const std::vector<Comparison>& comparisons);
// Returns the data behind the headline, for example "43 of 50 against 31 of 50 on the same seeds, exact
// McNemar p = 0.008." If the difference is not significant, adds which difference the episodes can detect,
// except for a sequential test. If two variations are compared, the text begins with this fact.
std::string Evidence(const Comparison& comparison);
// Returns Headline() and Evidence().
std::string Conclusion(const Comparison& comparison);

// Returns the difference of the success rates in percentage points. It has one decimal if its interval is
// narrower than two points or excludes 0 by less than half a point, or if whole points would contradict the
// rates in whole percents.
std::string DifferenceInPoints(const SuccessComparison& success);
// Returns the bounds of its interval in percentage points. They have one decimal if the interval is narrower
// than two points, or excludes 0 by less than half a point.
std::pair<std::string, std::string> BoundsInPoints(const SuccessComparison& success);
// Returns the difference with its interval, for example "24 points (8 to 39)".
std::string DifferenceText(const SuccessComparison& success);

// Returns a text that states which episodes the means of a task's metrics cover, and which test gives p.
std::string WhatIsCounted(const TaskComparison& task);
// Returns the title of the list of a task's metrics that have no difference to test.
std::string EqualTitle(const TaskComparison& task);
inline constexpr char kIntervalsAreSingle[] =
    "Intervals are not adjusted: each covers 95 % for its metric alone.";

// Joins names to "a, b and c".
std::string Enumerated(const std::vector<std::string>& names);

// Returns the display name of a test, for example "exact McNemar".
const char* TestName(SuccessTest test);

}  // namespace evalbus::results
