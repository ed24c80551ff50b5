// "Exact" confidence interval of a proportion, from the tails of the binomial distribution. Its coverage is
// at least 95 %, usually higher. Source: Clopper and Pearson 1934, "The use of confidence or fiducial limits
// illustrated in the case of the binomial", Biometrika 26.
#pragma once

#include <boost/math/distributions/binomial.hpp>

#include "metrics/statistics/interval.h"

namespace evalbus::metrics {

// Returns [0, 1] if there are no trials.
inline Interval ClopperPearsonInterval(double successes, double trials) {
  if (trials == 0) return {0, 1};
  using Binomial = boost::math::binomial_distribution<>;
  return {successes == 0 ? 0 : Binomial::find_lower_bound_on_p(trials, successes, kAlpha / 2),
          successes == trials ? 1 : Binomial::find_upper_bound_on_p(trials, successes, kAlpha / 2)};
}

}  // namespace evalbus::metrics
