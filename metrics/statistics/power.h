// What so many episodes can show, before they are run. Source: the usual normal approximation (Cohen 1988,
// "Statistical Power Analysis for the Behavioral Sciences"), at rates around one half, where it is hardest.
#pragma once

#include <algorithm>
#include <cmath>

namespace evalbus::metrics {

// Smallest difference of two success rates, of so many episodes each, that a test at 5 % finds four times in
// five. At most 1; pairs on equal seeds find less.
inline double DetectableDifference(int episodes) {
  constexpr double kTwoSided = 1.959964, kFourInFive = 0.841621, kVariance = 0.25;
  return std::min(1.0, (kTwoSided + kFourInFive) * std::sqrt(2 * kVariance / episodes));
}

}  // namespace evalbus::metrics
