// Rank-sum test of two independent samples. Source: Mann and Whitney 1947, "On a test of whether one of two
// random variables is stochastically larger than the other", Annals of Mathematical Statistics 18; ties as in
// Hollander, Wolfe and Chicken 2014, "Nonparametric statistical methods", 4.1.
#pragma once

#include <span>
#include <vector>

#include "metrics/statistics/ranks.h"
#include "metrics/statistics/ties.h"

namespace evalbus::metrics {

// statistic: U, the number of pairs (a, b) with a > b, plus half the number of pairs with a = b; ties.h
// decides equality. Up to 50 values in total, p is exact, also with ties: the distribution is computed over
// all ways to choose the first sample, given the ranks. For more values, p is the normal approximation with
// the variance corrected for ties. p = 1 if a sample is empty.
inline RankTest MannWhitneyTest(std::span<const double> a, std::span<const double> b) {
  if (a.empty() || b.empty()) return {};
  std::vector<double> all(a.begin(), a.end());
  all.insert(all.end(), b.begin(), b.end());
  const Ranks ranks = RankValues(WithTies(all));
  int twice = 0, twice_all = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    twice_all += ranks.twice[i];
    if (i < a.size()) twice += ranks.twice[i];
  }
  const auto m = static_cast<double>(a.size()), k = static_cast<double>(b.size()), n = m + k;

  RankTest test{.statistic = twice / 2.0 - m * (m + 1) / 2, .p = 1, .exact = all.size() <= 50};
  if (test.exact) {
    // choices[j][sum]: number of ways to choose j of the values with this rank sum.
    std::vector<std::vector<double>> choices(a.size() + 1,
                                             std::vector<double>(static_cast<size_t>(twice_all) + 1));
    choices[0][0] = 1;
    for (const int rank : ranks.twice) {
      for (size_t j = a.size(); j > 0; --j) {
        for (size_t sum = static_cast<size_t>(rank); sum < choices[j].size(); ++sum)
          choices[j][sum] += choices[j - 1][sum - static_cast<size_t>(rank)];
      }
    }
    test.p = ExactTwoSided(choices[a.size()], twice);
  } else {
    const double variance = m * k / 12 * (n + 1 - ranks.ties / (n * (n - 1)));
    test.p = NormalTwoSided(test.statistic, m * k / 2, variance);
  }
  return test;
}

}  // namespace evalbus::metrics
