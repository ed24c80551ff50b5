#include "metrics/statistics/power.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrics/statistics/exact_tests.h"
#include "metrics/statistics/sequential_mcnemar.h"

namespace evalbus::metrics::power_test {

double Choose(int n, int k) { return std::tgamma(n + 1.0) / std::tgamma(k + 1.0) / std::tgamma(n - k + 1.0); }

// Sums the probabilities of all numbers of discordant pairs among this many pairs.
TEST(Power, OfMcNemarIsThatOfAllOutcomes) {
  for (const int n : {5, 6, 10, 25}) {
    for (const auto& [a, b] : {std::pair(0.3, 0.1), {0.5, 0.0}, {0.6, 0.4}, {0.25, 0.25}}) {
      double expected = 0;
      for (int i = 0; i <= n; ++i) {
        for (int j = 0; i + j <= n; ++j) {
          if (i > j && McNemarTest(i, j) < kAlpha) {
            expected += Choose(n, i) * Choose(n - i, j) * std::pow(a, i) * std::pow(b, j) *
                        std::pow(std::max(0.0, 1 - a - b), n - i - j);
          }
        }
      }
      EXPECT_NEAR(McNemarPower(n, {a, b}), expected, 1e-9) << n << " " << a << " " << b;
    }
  }
  EXPECT_EQ(McNemarPower(5, {1, 0}), 0);
  EXPECT_DOUBLE_EQ(McNemarPower(6, {1, 0}), 1);
  EXPECT_EQ(McNemarPower(0, {0.5, 0.1}), 0);
}

TEST(Power, OfFisherIsThatOfAllTables) {
  for (const auto& [m, n] : {std::pair(4, 4), {10, 10}, {7, 15}, {20, 12}}) {
    for (const auto& [p, q] : {std::pair(0.9, 0.3), {0.6, 0.5}, {1.0, 0.2}}) {
      double expected = 0;
      for (int i = 0; i <= m; ++i) {
        for (int j = 0; j <= n; ++j) {
          if (i * n > j * m && FisherTest(i, m, j, n) < kAlpha) {
            expected += Choose(m, i) * std::pow(p, i) * std::pow(1 - p, m - i) * Choose(n, j) *
                        std::pow(q, j) * std::pow(1 - q, n - j);
          }
        }
      }
      EXPECT_NEAR(FisherPower(m, n, p, q), expected, 1e-9) << m << " " << n << " " << p << " " << q;
    }
  }
  // The values are nearly continuous where the normal approximation begins.
  EXPECT_NEAR(FisherPower(500, 500, 0.55, 0.45), FisherPower(501, 501, 0.55, 0.45), 0.02);
}

// For few pairs, the power is computed exactly, from the probabilities of all (only_a, only_b) that are not
// decided yet.
TEST(Power, OfTheSequentialTestIsThatOfAllWays) {
  const DiscordantShares shares{0.5, 0.1};
  constexpr int kMax = 40, kStep = 5;
  std::vector<std::vector<double>> open(kMax + 2, std::vector<double>(kMax + 2));
  open[0][0] = 1;
  double found = 0;
  for (int pair = 1; pair <= kMax; ++pair) {
    auto next = std::vector(open.size(), std::vector<double>(open.size()));
    for (size_t a = 0; a <= kMax; ++a) {
      for (size_t b = 0; b <= kMax; ++b) {
        next[a + 1][b] += open[a][b] * shares.only_a;
        next[a][b + 1] += open[a][b] * shares.only_b;
        next[a][b] += open[a][b] * (1 - shares.only_a - shares.only_b);
      }
    }
    open = next;
    if (pair % kStep != 0) continue;
    for (size_t a = 0; a <= kMax; ++a) {
      for (size_t b = 0; b <= kMax; ++b) {
        const Wins wins{static_cast<int>(a), static_cast<int>(b)};
        if (SequentialP(wins, std::nullopt, pair == kMax) > kAlpha) continue;
        if (a > b) found += open[a][b];
        open[a][b] = 0;
      }
    }
  }
  // The tolerance is four standard errors of 4,000 simulations.
  EXPECT_NEAR(SequentialPower(kStep, kMax, shares), found, 4 * std::sqrt(found * (1 - found) / 4000));
  EXPECT_GT(found, 0.5);
  EXPECT_LT(found, 0.95);
}

// By the normal approximation, 10 pairs detect a difference of 62.6 points with 80 % power. The exact test
// detects it with only 62 %.
TEST(Power, FindableDifferenceIsFoundFourTimesInFive) {
  const auto power = [](int pairs) {
    return [pairs](double difference) {
      return McNemarPower(pairs, DiscordantShares::AroundOneHalf(difference));
    };
  };
  EXPECT_NEAR(power(10)(0.626), 0.62, 0.01);
  for (const int pairs : {10, 20, 50, 100, 400}) {
    const double found = *FindableDifference(power(pairs));
    EXPECT_GE(power(pairs)(found), kWantedPower) << pairs;
    EXPECT_LT(power(pairs)(found - 0.001), kWantedPower) << pairs;
  }
  EXPECT_FALSE(FindableDifference(power(5)));
}

TEST(Power, TrialsNeededAreTheFewest) {
  const auto power = [](int pairs) { return McNemarPower(pairs, {0.3, 0.1}); };
  const int needed = *TrialsNeeded(power);
  EXPECT_GE(power(needed), kWantedPower);
  EXPECT_LT(power(needed - 1), kWantedPower);
  EXPECT_FALSE(TrialsNeeded([](int pairs) { return McNemarPower(pairs, {0.1, 0.0999}); }));
}

}  // namespace evalbus::metrics::power_test
