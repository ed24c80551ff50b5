// Anytime-valid confidence intervals of a proportion. With probability at least 95 %, the intervals after
// each trial all contain the true proportion. They may therefore be inspected after each trial and used to
// stop early. Source: Robbins 1970, "Statistical methods related to the law of the iterated logarithm",
// Annals of Mathematical Statistics 41, after Ville 1939. The likelihood averaged over all rates, divided by
// the likelihood of the true rate, is a martingale that starts at 1. Therefore, the probability that it ever
// reaches 1 / alpha is at most alpha.
#pragma once

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>

#include "metrics/statistics/interval.h"

namespace evalbus::metrics {

// Returns the interval of rates p with (n + 1) C(n, k) p^k (1 - p)^(n - k) > alpha, for k successes in n
// trials. [0, 1] without trials.
inline Interval ConfidenceSequence(double successes, double trials, double alpha = kAlpha) {
  if (trials == 0) return {0, 1};
  const double failures = trials - successes;
  const double log_weight = std::log(trials + 1) + boost::math::lgamma(trials + 1) -
                            boost::math::lgamma(successes + 1) - boost::math::lgamma(failures + 1) -
                            std::log(alpha);
  // Returns a value that is positive inside the interval. The observed rate is always inside, because it has
  // the highest likelihood.
  const auto inside = [&](double p) {
    // With exponent 0, returns the limit for p = 0 and p = 1, because 0 * infinity would be NaN.
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

// Returns the smallest number of trials at which the interval is at most this wide for any number of
// successes. The interval is widest if half of the trials succeed. Returns most + 1 if `most` trials do not
// suffice.
inline int TrialsForWidth(double width, int most) {
  int few = 0, enough = most + 1;
  while (enough - few > 1) {
    const int trials = few + (enough - few) / 2;
    const Interval interval = ConfidenceSequence(trials / 2.0, trials);
    (interval.upper - interval.lower > width ? few : enough) = trials;
  }
  return enough;
}

}  // namespace evalbus::metrics
