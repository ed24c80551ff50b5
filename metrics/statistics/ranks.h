// Ranks for the Wilcoxon and Mann-Whitney tests.
#pragma once

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

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
  // True if p is from the exact distribution, false if from its normal approximation.
  bool exact = true;
};

// Two-sided p of a statistic, by normal approximation with a continuity correction of half a rank.
inline double NormalTwoSided(double statistic, double mean, double variance) {
  if (!(variance > 0)) return 1;
  const double z = std::max(0.0, std::abs(statistic - mean) - 0.5) / std::sqrt(variance);
  return std::min(1.0, 2 * cdf(complement(boost::math::normal_distribution<>(), z)));
}

// Two-sided p of a statistic whose value s has the probability weights[s] / (sum of weights): twice the
// smaller tail, at most 1.
inline double ExactTwoSided(const std::vector<double>& weights, int statistic) {
  const auto at = weights.begin() + statistic;
  const double all = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double lower = std::accumulate(weights.begin(), at + 1, 0.0);
  const double upper = std::accumulate(at, weights.end(), 0.0);
  return std::min(1.0, 2 * std::min(lower, upper) / all);
}

}  // namespace evalbus::metrics
