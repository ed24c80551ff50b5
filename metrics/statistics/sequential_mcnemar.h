// Anytime-valid test for equality of two success rates on paired data: it may be evaluated after every pair,
// and the comparison may be stopped at any of them. If the two policies are equal, each wins half of the
// discordant pairs (in which only one of the two succeeded). Robbins' average of the likelihood over all
// other shares (confidence_sequence.h), divided by the likelihood of one half, is then a martingale that
// starts at 1. It ever reaches 1 / alpha with probability at most alpha (Ville 1939). Snyder et al. 2025, "Is
// Your Imitation Learning Policy Better than Mine? Policy Comparison with Near-Optimal Stopping" (STEP), need
// fewer pairs; this test needs only a formula.
#pragma once

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>

namespace evalbus::metrics {

// p-value from the discordant pairs, valid whenever it is evaluated: min(1, (n + 1) C(n, a) / 2^n), n = a +
// b. The smallest value so far counts.
inline double SequentialMcNemar(int only_a, int only_b) {
  const double n = only_a + only_b;
  const double log_p = std::log(n + 1) + boost::math::lgamma(n + 1) - boost::math::lgamma(only_a + 1.0) -
                       boost::math::lgamma(only_b + 1.0) - n * std::log(2.0);
  return std::min(1.0, std::exp(log_p));
}

}  // namespace evalbus::metrics
