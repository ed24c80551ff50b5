// The result of a comparison in sentences.
#pragma once

#include <string>

#include "results/comparison.h"

namespace evalbus::results {

// For example "B is 24 points better than A, 95 % CI 8 to 39", without a period.
std::string Headline(const Comparison& comparison);
// What the headline is based on: "43 of 50 against 31 of 50 on the same seeds, exact McNemar p = 0.008."
// and, if no difference is shown, which one the episodes can detect. If two variations are compared, the text
// begins with that.
std::string Evidence(const Comparison& comparison);
// Headline and evidence.
std::string Conclusion(const Comparison& comparison);

// For example "24 points (8 to 39)", or with a decimal if the interval is narrow.
std::string DifferenceText(const SuccessComparison& success);

// Describes which episodes the means of a task's metrics cover, and which test p comes from.
std::string WhatIsCounted(const TaskComparison& task);
inline constexpr char kIntervalsAreSingle[] =
    "Intervals are not adjusted: each covers 95 % for its metric alone.";

// Display name of a test, for example "exact McNemar".
const char* TestName(SuccessTest test);

}  // namespace evalbus::results
