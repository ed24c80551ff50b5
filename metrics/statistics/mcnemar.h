// Exact test for equality of two success rates on paired data. Source: McNemar 1947, "Note on the sampling
// error of the difference between correlated proportions or percentages", Psychometrika 12, with the binomial
// distribution in place of chi-squared.
#pragma once

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>

namespace evalbus::metrics {

// Returns the two-sided p, min(1, 2 P(Binomial(a + b, 1/2) <= min(a, b))), where a and b are the numbers of
// discordant pairs, in which only a or only b succeeded. 1 if there are no discordant pairs.
inline double McNemarTest(int only_a, int only_b) {
  const int discordant = only_a + only_b;
  if (discordant == 0) return 1;
  const boost::math::binomial_distribution<> binomial(discordant, 0.5);
  return std::min(1.0, 2 * cdf(binomial, std::min(only_a, only_b)));
}

}  // namespace evalbus::metrics
