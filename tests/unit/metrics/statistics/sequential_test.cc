#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <random>

#include "metrics/statistics/power.h"
#include "metrics/statistics/sequential_mcnemar.h"

namespace evalbus::metrics::sequential_test {

TEST(SequentialMcNemar, EvidenceIsTheMixtureOverOneHalf) {
  EXPECT_NEAR(EvidenceOf({0, 0}), 1, 1e-12);
  EXPECT_NEAR(EvidenceOf({1, 0}), 1, 1e-12);
  // C(2n, n) / 2^n for n pairs won by the same policy.
  EXPECT_NEAR(EvidenceOf({8, 0}), 12870.0 / 256, 1e-10);
  EXPECT_NEAR(EvidenceOf({0, 8}), 12870.0 / 256, 1e-10);
  // The average by numerical integration over share = sin^2(angle), whose angle is uniform.
  constexpr int kSteps = 1000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = (i + 0.5) / kSteps * std::numbers::pi / 2;
    sum += std::pow(std::sin(angle), 18) * std::pow(std::cos(angle), 2) * 1024;
  }
  EXPECT_NEAR(EvidenceOf({9, 1}), sum / kSteps, 1e-9);
}

TEST(SequentialMcNemar, EvidenceIsAMartingaleOfEqualPolicies) {
  for (int a = 0; a < 20; ++a) {
    for (int b = 0; b < 20; ++b) {
      EXPECT_NEAR((EvidenceOf({a + 1, b}) + EvidenceOf({a, b + 1})) / 2 / EvidenceOf({a, b}), 1, 1e-12);
    }
  }
}

TEST(SequentialMcNemar, LooksAndTheLastTestShareAlpha) {
  // Looks have 40 % of alpha: 8 pairs, with evidence 50.3, are the fewest that decide at 0.05.
  EXPECT_NEAR(SequentialP({8, 0}, std::nullopt, false), 256.0 / 12870 / 0.4, 1e-12);
  EXPECT_LT(SequentialP({8, 0}, std::nullopt, false), 0.05);
  EXPECT_GT(SequentialP({7, 0}, std::nullopt, false), 0.05);
  // The last test has 60 %: 2 / 2^7 / 0.6.
  EXPECT_NEAR(SequentialP({7, 0}, std::nullopt, true), 2.0 / 128 / 0.6, 1e-12);
  EXPECT_EQ(SequentialP({3, 3}, std::nullopt, true), 1);
}

TEST(SequentialMcNemar, ProgressIsAveragedWithSuccess) {
  EXPECT_NEAR(SequentialP({0, 0}, Wins{8, 0}, false), 1 / (0.4 * (1 + 12870.0 / 256) / 2), 1e-12);
  // Pairs that differ in progress only need one or two more than pairs that differ in success.
  EXPECT_GT(SequentialP({0, 0}, Wins{8, 0}, false), 0.05);
  EXPECT_LE(SequentialP({0, 0}, Wins{10, 0}, false), 0.05);
}

// How often a comparison is decided, and after how many pairs.
struct Simulated {
  double decided = 0, mean_pairs = 0;
};
struct Rates {
  double a, b;
  // Chance that a is ahead of b in a pair with equal success.
  double ahead = 0.5;
};
Simulated Simulate(const Rates& rates, int step, int most, double alpha, bool on_progress) {
  constexpr int kRepetitions = 10'000;
  std::mt19937 random(7);
  std::uniform_real_distribution<> uniform;
  int decided = 0;
  double pairs = 0;
  for (int i = 0; i < kRepetitions; ++i) {
    Wins success, progress;
    int n = 0;
    bool is_decided = false;
    while (n < most && !is_decided) {
      ++n;
      const bool a = uniform(random) < rates.a, b = uniform(random) < rates.b;
      success.a += a && !b;
      success.b += b && !a;
      const bool ahead = a != b ? a : uniform(random) < rates.ahead;
      ++(ahead ? progress.a : progress.b);
      if (n % step != 0 && n != most) continue;
      is_decided =
          SequentialP(success, on_progress ? std::optional(progress) : std::nullopt, n == most) <= alpha;
    }
    decided += is_decided;
    pairs += n;
  }
  return {decided / double{kRepetitions}, pairs / kRepetitions};
}

TEST(SequentialMcNemar, TestingAfterEveryPairKeepsTheErrorRate) {
  for (const double rate : {0.1, 0.5, 0.9}) {
    for (const bool on_progress : {false, true}) {
      // Progress is a fair coin at every rate.
      if (on_progress && rate != 0.5) continue;
      const Simulated equal = Simulate({rate, rate}, 1, 200, 0.05, on_progress);
      std::printf("equal policies, rate %.1f, %s: %.2f %% decided\n", rate,
                  on_progress ? "success and progress" : "success", 100 * equal.decided);
      // Standard error of 10,000 repetitions: 0.2 points.
      EXPECT_LT(equal.decided, 0.05) << rate;
    }
  }
  // Without correction, tests after every pair err far more often: the simulation detects it.
  EXPECT_GT(Simulate({0.5, 0.5}, 1, 200, 0.5, false).decided, 0.1);
}

TEST(SequentialMcNemar, StopsEarlyWhereItIsClear) {
  const Simulated looks = Simulate({0.9, 0.4}, 1, 200, 0.05, false);
  EXPECT_GT(looks.decided, 0.99);
  EXPECT_LT(looks.mean_pairs, 50);
}

// Policies of equal success, of which one gets further or is faster in 80 % of the pairs.
TEST(SequentialMcNemar, ProgressDecidesWhereSuccessCannot) {
  const Rates rates{0.7, 0.7, 0.8};
  EXPECT_LT(Simulate(rates, 1, 200, 0.05, false).decided, 0.05);
  const Simulated with = Simulate(rates, 1, 200, 0.05, true);
  std::printf("equal success, ahead in 80 %%: decided in %.0f %% after %.0f pairs\n", 100 * with.decided,
              with.mean_pairs);
  EXPECT_GT(with.decided, 0.9);
  EXPECT_LT(with.mean_pairs, 110);
}

// With the exact test at the last look, little power is lost against a test of a fixed number of pairs: only
// one policy succeeds in 15 % of 200 pairs, only the other one in 5 %.
TEST(SequentialMcNemar, FindsMostOfWhatAFixedTestFinds) {
  const DiscordantShares shares{0.15, 0.05};
  const double fixed = McNemarPower(200, shares), sequential = SequentialPower(10, 200, shares);
  std::printf("15 : 5 of 200 pairs: fixed test %.0f %%, tested every 10 pairs %.0f %%\n", 100 * fixed,
              100 * sequential);
  EXPECT_GT(fixed, 0.86);
  EXPECT_GT(sequential, 0.8);
}

}  // namespace evalbus::metrics::sequential_test
