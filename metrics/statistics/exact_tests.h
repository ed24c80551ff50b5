// Exact tests for equality of two success rates.
#pragma once

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/hypergeometric.hpp>

namespace evalbus::metrics {

// Test on paired data. Source: McNemar 1947, "Note on the sampling error of the difference between correlated
// proportions or percentages", Psychometrika 12, with the binomial distribution in place of chi-squared.
//
// Returns the two-sided p, min(1, 2 P(Binomial(a + b, 1/2) <= min(a, b))), where a and b are the numbers of
// discordant pairs, in which only a or only b succeeded. 1 if there are no discordant pairs.
inline double McNemarTest(int only_a, int only_b) {
  const int discordant = only_a + only_b;
  if (discordant == 0) return 1;
  const boost::math::binomial_distribution<> binomial(discordant, 0.5);
  return std::min(1.0, 2 * cdf(binomial, std::min(only_a, only_b)));
}

// Test of two independent samples, conditional on the total number of successes. Conservative. Source: Fisher
// 1935, "The logic of inductive inference", Journal of the Royal Statistical Society 98.
//
// Returns the two-sided p: the total probability, given the margins, of all tables that are at most as
// probable as the observed table. 1 if a sample is empty.
inline double FisherTest(int successes_a, int trials_a, int successes_b, int trials_b) {
  const int successes = successes_a + successes_b, trials = trials_a + trials_b;
  if (trials_a == 0 || trials_b == 0) return 1;
  const boost::math::hypergeometric_distribution<> given_margins(successes, trials_a, trials);
  // Tables of equal probability must count as equal despite rounding.
  const double limit = pdf(given_margins, successes_a) * (1 + 1e-7);
  double p = 0;
  for (int k = std::max(0, successes - trials_b); k <= std::min(successes, trials_a); ++k) {
    const double probability = pdf(given_margins, k);
    if (probability <= limit) p += probability;
  }
  return std::min(1.0, p);
}

}  // namespace evalbus::metrics
