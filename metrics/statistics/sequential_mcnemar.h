// A test of two success rates on pairs for somebody who looks after every pair and may stop at any. Source:
// of the pairs in which only one of the two succeeded, equal policies win half; Robbins' average over all
// other shares (confidence_sequence.h), over the likelihood of one half, is a martingale from 1 on, which
// ever comes to 1 / alpha with probability alpha at most (Ville 1939). What Snyder et al. 2025, "Is Your
// Imitation Learning Policy Better than Mine? Policy Comparison with Near-Optimal Stopping" (STEP), do with
// less pairs, this does with a formula.
#pragma once

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>

namespace evalbus::metrics {

// p of the pairs in which only one of the two succeeded, valid whenever one looks: min(1, (n + 1) C(n, a) /
// 2^n), n = a + b. The smallest of all looks so far counts.
inline double SequentialMcNemar(int only_a, int only_b) {
  const double n = only_a + only_b;
  const double log_p = std::log(n + 1) + boost::math::lgamma(n + 1) - boost::math::lgamma(only_a + 1.0) -
                       boost::math::lgamma(only_b + 1.0) - n * std::log(2.0);
  return std::min(1.0, std::exp(log_p));
}

}  // namespace evalbus::metrics
