// Rank tests.
#pragma once

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "metrics/statistics/ties.h"

namespace evalbus::metrics {

struct Ranks {
  // Twice the rank of each value, so that the mean ranks of ties are whole numbers.
  std::vector<int> twice;
  // Sum over groups of t equal values of t^3 - t.
  double ties = 0;
};

inline Ranks RankValues(std::span<const double> values) {
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return values[a] < values[b]; });
  Ranks ranks{.twice = std::vector<int>(values.size()), .ties = 0};
  for (size_t first = 0; first < order.size();) {
    size_t last = first;
    while (last + 1 < order.size() && values[order[last + 1]] == values[order[first]]) ++last;
    for (size_t k = first; k <= last; ++k) ranks.twice[order[k]] = static_cast<int>(first + last + 2);
    const auto t = static_cast<double>(last - first + 1);
    ranks.ties += t * t * t - t;
    first = last + 1;
  }
  return ranks;
}

// Result of a rank test.
struct RankTest {
  // The statistic of the test: a rank sum (Wilcoxon) or U (Mann-Whitney).
  double statistic = 0;
  // Two-sided p-value.
  double p = 1;
  // The smallest p that these ranks can yield, whatever the signs (Wilcoxon) or the samples (Mann-Whitney) to
  // which they belong; 0 if p is approximate.
  double least_p = 1;
  // True if p is from the exact distribution, false if from its normal approximation.
  bool exact = true;
};

// Returns the two-sided p of a statistic, by normal approximation with a continuity correction of half a
// rank.
inline double NormalTwoSided(double statistic, double mean, double variance) {
  if (!(variance > 0)) return 1;
  const double z = std::max(0.0, std::abs(statistic - mean) - 0.5) / std::sqrt(variance);
  return std::min(1.0, 2 * cdf(complement(boost::math::normal_distribution<>(), z)));
}

// Sets the two-sided p (twice the smaller tail, at most 1) of a statistic whose value s has the probability
// weights[s] / (sum of weights), and the least p of all its values.
inline void SetExactTwoSided(const std::vector<double>& weights, int statistic, RankTest* test) {
  const auto at = weights.begin() + statistic;
  const double all = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double lower = std::accumulate(weights.begin(), at + 1, 0.0);
  const double upper = std::accumulate(at, weights.end(), 0.0);
  test->p = std::min(1.0, 2 * std::min(lower, upper) / all);
  const auto is_possible = [](double weight) { return weight > 0; };
  const double lowest = *std::find_if(weights.begin(), weights.end(), is_possible);
  const double highest = *std::find_if(weights.rbegin(), weights.rend(), is_possible);
  test->least_p = std::min(1.0, 2 * std::min(lowest, highest) / all);
}

// Signed-rank test of paired differences. Source: Wilcoxon 1945, "Individual comparisons by ranking methods",
// Biometrics Bulletin 1; ties as in Hollander, Wolfe and Chicken 2014, "Nonparametric statistical methods",
// 3.1.
//
// ties.h decides whether differences are equal or zero. Zero differences are dropped, as in Wilcoxon's paper.
// statistic: sum of the ranks of positive differences. For up to 50 remaining differences, p is exact, even
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

  RankTest test{.statistic = twice / 2.0, .p = 1, .least_p = 0, .exact = sizes.size() <= 50};
  if (test.exact) {
    // Number of the 2^n sign choices that yield each sum.
    std::vector<double> choices(
        static_cast<size_t>(std::accumulate(ranks.twice.begin(), ranks.twice.end(), 1)));
    choices[0] = 1;
    for (const int rank : ranks.twice) {
      for (size_t sum = choices.size(); sum-- > static_cast<size_t>(rank);)
        choices[sum] += choices[sum - static_cast<size_t>(rank)];
    }
    SetExactTwoSided(choices, twice, &test);
  } else {
    const auto n = static_cast<double>(sizes.size());
    const double variance = n * (n + 1) * (2 * n + 1) / 24 - ranks.ties / 48;
    test.p = NormalTwoSided(test.statistic, n * (n + 1) / 4, variance);
  }
  return test;
}

// Rank-sum test of two independent samples. Source: Mann and Whitney 1947, "On a test of whether one of two
// random variables is stochastically larger than the other", Annals of Mathematical Statistics 18; ties as in
// Hollander, Wolfe and Chicken 2014, "Nonparametric statistical methods", 4.1.
//
// statistic: U, the number of pairs (a, b) with a > b, plus half the number of pairs with a = b; ties.h
// decides equality. Up to 50 values in total, p is exact, even with ties: the distribution is computed over
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

  RankTest test{.statistic = twice / 2.0 - m * (m + 1) / 2, .p = 1, .least_p = 0, .exact = all.size() <= 50};
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
    SetExactTwoSided(choices[a.size()], twice, &test);
  } else {
    const double variance = m * k / 12 * (n + 1 - ranks.ties / (n * (n - 1)));
    test.p = NormalTwoSided(test.statistic, m * k / 2, variance);
  }
  return test;
}

}  // namespace evalbus::metrics
