// Signed-rank test of paired differences. Source: Wilcoxon 1945, "Individual comparisons by ranking methods",
// Biometrics Bulletin 1; ties as in Hollander, Wolfe and Chicken 2014, "Nonparametric statistical
// methods", 3.1.
#pragma once

#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "metrics/statistics/ranks.h"
#include "metrics/statistics/ties.h"

namespace evalbus::metrics {

// ties.h decides whether differences are equal or zero. Zero differences are dropped, as in Wilcoxon's paper.
// statistic: sum of the ranks of positive differences. For up to 50 remaining differences, p is exact, also
// with ties: the distribution is computed over all choices of signs, given the ranks. For more differences, p
// is the normal approximation with the variance corrected for ties. p = 1 if no difference remains.
inline RankTest WilcoxonSignedRankTest(std::span<const double> differences) {
  std::vector<double> sizes;
  std::vector<bool> positive;
  for (const double difference : WithTies(differences)) {
    if (difference == 0) continue;
    sizes.push_back(std::abs(difference));
    positive.push_back(difference > 0);
  }
  if (sizes.empty()) return {};
  const Ranks ranks = RankValues(sizes);
  int twice = 0;
  for (size_t i = 0; i < sizes.size(); ++i) twice += positive[i] ? ranks.twice[i] : 0;

  RankTest test{.statistic = twice / 2.0, .p = 1, .exact = sizes.size() <= 50};
  if (test.exact) {
    // Number of the 2^n sign choices that yield each sum.
    std::vector<double> choices(
        static_cast<size_t>(std::accumulate(ranks.twice.begin(), ranks.twice.end(), 1)));
    choices[0] = 1;
    for (const int rank : ranks.twice) {
      for (size_t sum = choices.size(); sum-- > static_cast<size_t>(rank);)
        choices[sum] += choices[sum - static_cast<size_t>(rank)];
    }
    test.p = ExactTwoSided(choices, twice);
  } else {
    const auto n = static_cast<double>(sizes.size());
    const double variance = n * (n + 1) * (2 * n + 1) / 24 - ranks.ties / 48;
    test.p = NormalTwoSided(test.statistic, n * (n + 1) / 4, variance);
  }
  return test;
}

}  // namespace evalbus::metrics
