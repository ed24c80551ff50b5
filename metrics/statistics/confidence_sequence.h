// Intervals of a proportion for somebody who looks after every trial: with probability 95 % all of them, from
// the first trial on, hold it at once, so that stopping when they look good is no error. Source: Robbins
// 1970, "Statistical methods related to the law of the iterated logarithm", Annals of Mathematical Statistics
// 41, after Ville 1939: the likelihoods of all rates, averaged, over that of the true one are a martingale
// from 1 on, which ever comes to 1 / alpha with probability alpha at most.
#pragma once

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>

#include "metrics/statistics/interval.h"

namespace evalbus::metrics {

// The rates p with (n + 1) C(n, k) p^k (1 - p)^(n - k) > alpha, of k successes in n trials. [0, 1] without
// trials.
inline Interval ConfidenceSequence(double successes, double trials, double alpha = kAlpha) {
  if (trials == 0) return {0, 1};
  const double failures = trials - successes;
  const double log_weight = std::log(trials + 1) + boost::math::lgamma(trials + 1) -
                            boost::math::lgamma(successes + 1) - boost::math::lgamma(failures + 1) -
                            std::log(alpha);
  // Positive within the interval: at the rate itself it is, since that is the likeliest.
  const auto inside = [&](double p) {
    // Its limit at p = 0 and 1, where no infinity may come in.
    const auto power = [](double base, double exponent) {
      return exponent == 0 ? 0 : exponent * std::log(base);
    };
    return std::max(-1e300, log_weight + power(p, successes) + power(1 - p, failures));
  };
  const auto bound = [&](double outside) {
    const double rate = successes / trials;
    const auto [from, to] =
        boost::math::tools::bisect(inside, std::min(outside, rate), std::max(outside, rate),
                                   boost::math::tools::eps_tolerance<double>());
    return (from + to) / 2;
  };
  return {successes == 0 ? 0 : bound(0), failures == 0 ? 1 : bound(1)};
}

}  // namespace evalbus::metrics
