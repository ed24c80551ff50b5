// Compares the statistical procedures with published values, and with enumerations that share no formula with
// them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "metrics/statistics/clopper_pearson.h"
#include "metrics/statistics/confidence_sequence.h"
#include "metrics/statistics/describe.h"
#include "metrics/statistics/exact_tests.h"
#include "metrics/statistics/holm.h"
#include "metrics/statistics/interval.h"
#include "metrics/statistics/interval_of_mean.h"
#include "metrics/statistics/rank_tests.h"

namespace evalbus::metrics::statistics_test {

using Values = std::vector<double>;

void ExpectInterval(const Interval& interval, double lower, double upper, double tolerance) {
  EXPECT_NEAR(interval.lower, lower, tolerance);
  EXPECT_NEAR(interval.upper, upper, tolerance);
}

double BinomialCoefficient(int n, int k) {
  double result = 1;
  for (int i = 0; i < k; ++i) result = result * (n - i) / (i + 1);
  return result;
}

// Returns P(at least k of n succeed), computed as the sum of its definition.
double BinomialTail(int k, int n, double p) {
  double sum = 0;
  for (int i = k; i <= n; ++i) sum += BinomialCoefficient(n, i) * std::pow(p, i) * std::pow(1 - p, n - i);
  return sum;
}

TEST(Describe, QuantilesInterpolate) {
  const Values x = {1, 2, 4, 8, 16};
  EXPECT_EQ(Quantile(x, 0), 1);
  EXPECT_EQ(Quantile(x, 0.5), 4);
  EXPECT_EQ(Quantile(x, 1), 16);
  EXPECT_DOUBLE_EQ(Quantile(x, 0.05), 1.2);   // a fifth of the way from 1 to 2
  EXPECT_DOUBLE_EQ(Quantile(x, 0.95), 14.4);  // four fifths from 8 to 16
  EXPECT_DOUBLE_EQ(Quantile(Values{3, 5}, 0.5), 4);
  EXPECT_EQ(Quantile(Values{3}, 0.95), 3);
  EXPECT_TRUE(std::isnan(Quantile({}, 0.5)));
  EXPECT_DOUBLE_EQ(Mean(x), 6.2);
  EXPECT_NEAR(StandardDeviation(x), std::sqrt(148.8 / 4), 1e-14);
  EXPECT_TRUE(std::isnan(StandardDeviation(Values{3})));
}

TEST(WilsonInterval, PublishedValues) {
  ExpectInterval(WilsonInterval(43, 50), 0.738138, 0.930492, 5e-7);
  // Newcombe 1998 (Statistics in Medicine 17, 857-872), table I.
  ExpectInterval(WilsonInterval(81, 263), 0.2553, 0.3662, 5e-5);
  ExpectInterval(WilsonInterval(15, 148), 0.0624, 0.1605, 5e-5);
  ExpectInterval(WilsonInterval(0, 20), 0, 0.1611, 5e-5);
  ExpectInterval(WilsonInterval(1, 29), 0.0061, 0.1718, 5e-5);
  EXPECT_EQ(WilsonInterval(0, 10).lower, 0);
  EXPECT_EQ(WilsonInterval(10, 10).upper, 1);
  ExpectInterval(WilsonInterval(0, 0), 0, 1, 0);
}

TEST(WilsonInterval, BoundsAreWhereTheScoreTestDecides) {
  // The bound is the rate at which the score test's statistic is exactly z.
  for (const auto& [k, n] : {std::pair(3, 10), {43, 50}, {1, 200}}) {
    const double p = static_cast<double>(k) / n;
    for (const double bound : {WilsonInterval(k, n).lower, WilsonInterval(k, n).upper})
      EXPECT_NEAR(std::abs(p - bound) / std::sqrt(bound * (1 - bound) / n), kNormal975, 1e-9);
  }
}

TEST(ClopperPearsonInterval, PublishedValues) {
  ExpectInterval(ClopperPearsonInterval(43, 50), 0.732604, 0.941808, 5e-7);
  ExpectInterval(ClopperPearsonInterval(81, 263), 0.2527, 0.3676, 5e-5);
  ExpectInterval(ClopperPearsonInterval(0, 20), 0, 0.1684, 5e-5);
  ExpectInterval(ClopperPearsonInterval(0, 0), 0, 1, 0);
  EXPECT_EQ(ClopperPearsonInterval(20, 20).upper, 1);
}

TEST(ClopperPearsonInterval, BoundsLeaveTailsOfOneFortieth) {
  for (const auto& [k, n] : {std::pair(3, 10), {43, 50}, {1, 30}}) {
    EXPECT_NEAR(BinomialTail(k, n, ClopperPearsonInterval(k, n).lower), 0.025, 1e-9);
    EXPECT_NEAR(1 - BinomialTail(k + 1, n, ClopperPearsonInterval(k, n).upper), 0.025, 1e-9);
  }
}

TEST(ConfidenceSequence, IsWhereTheMixtureOfLikelihoodsDecides) {
  // Expected values are computed by bisection in Python or, if a bound has a closed form, from (n + 1) p^n =
  // alpha.
  ExpectInterval(ConfidenceSequence(9, 10), 0.4548817472868107, 0.9995435831173225, 1e-12);
  ExpectInterval(ConfidenceSequence(43, 50), 0.661614724331578, 0.9671510979350244, 1e-12);
  ExpectInterval(ConfidenceSequence(500, 1000), 0.4443853297425172, 0.5556146702574827, 1e-12);
  ExpectInterval(ConfidenceSequence(10, 10), std::pow(0.05 / 11, 0.1), 1, 1e-12);
  ExpectInterval(ConfidenceSequence(0, 10), 0, 1 - std::pow(0.05 / 11, 0.1), 1e-12);
  ExpectInterval(ConfidenceSequence(0, 0), 0, 1, 0);
  // The number of successes need not be an integer. The bounds are between the bounds for the neighboring
  // integers.
  EXPECT_GT(ConfidenceSequence(2.25, 3).lower, ConfidenceSequence(2, 3).lower);
  EXPECT_LT(ConfidenceSequence(2.25, 3).upper, ConfidenceSequence(3, 3).upper + 1e-12);
}

// Returns the share of 10,000 runs in which the interval misses the rate after any of the first 200 trials.
double EverMissed(const std::function<Interval(int, int)>& interval, double rate) {
  constexpr int kTrials = 200, kRuns = 10000;
  std::vector<std::vector<bool>> misses(kTrials + 1);
  for (int n = 1; n <= kTrials; ++n) {
    for (int k = 0; k <= n; ++k) {
      const Interval at = interval(k, n);
      misses[static_cast<size_t>(n)].push_back(rate < at.lower || rate > at.upper);
    }
  }
  std::mt19937_64 random(1970);
  int missed = 0;
  for (int run = 0; run < kRuns; ++run) {
    bool ever = false;
    size_t k = 0;
    for (size_t n = 1; n <= kTrials; ++n) {
      k += static_cast<double>(random() >> 11) * 0x1p-53 < rate;
      ever = ever || misses[n][k];
    }
    missed += ever;
  }
  return static_cast<double>(missed) / kRuns;
}

TEST(ConfidenceSequence, IsNarrowForAnyRateAfterEnoughTrials) {
  const auto width = [](int successes, int trials) {
    const Interval interval = ConfidenceSequence(successes, trials);
    return interval.upper - interval.lower;
  };
  EXPECT_EQ(TrialsForWidth(0.1, 10'000), 1262);  // docs/plans.md
  EXPECT_EQ(TrialsForWidth(0.1, 1262), 1262);
  EXPECT_EQ(TrialsForWidth(0.1, 1261), 1262);
  for (const double wanted : {0.1, 0.2}) {
    const int trials = TrialsForWidth(wanted, 10'000);
    for (int successes = 0; successes <= trials; ++successes) EXPECT_LE(width(successes, trials), wanted);
    EXPECT_GT(width((trials - 2) / 2, trials - 2), wanted);
  }
}

TEST(ConfidenceSequence, CoversAtAllTimesAtOnce) {
  for (const double rate : {0.5, 0.8, 0.97}) {
    // The share is at most 5 %. With 10,000 runs, an estimate of 5 % is off by less than one point.
    EXPECT_LT(EverMissed([](int k, int n) { return ConfidenceSequence(k, n); }, rate), 0.05) << rate;
    // An interval for a single look at the end does not have this property.
    EXPECT_GT(EverMissed(WilsonInterval, rate), 0.3) << rate;
  }
}

TEST(NewcombeInterval, PublishedValues) {
  // Newcombe 1998 (Statistics in Medicine 17, 873-890), table II, method 10.
  ExpectInterval(NewcombeInterval(56, 70, 48, 80), 0.0524, 0.3339, 5e-5);
  ExpectInterval(NewcombeInterval(9, 10, 3, 10), 0.1705, 0.8090, 5e-5);
  ExpectInterval(NewcombeInterval(6, 7, 2, 7), 0.0582, 0.8062, 5e-5);
  ExpectInterval(NewcombeInterval(5, 56, 0, 29), -0.0381, 0.1926, 5e-5);
  ExpectInterval(NewcombeInterval(10, 10, 0, 10), 0.6075, 1, 5e-5);
  ExpectInterval(NewcombeInterval(0, 0, 1, 2), -1, 1, 0);
}

TEST(NewcombePairedInterval, PublishedValues) {
  // Newcombe 1998 (Statistics in Medicine 17, 2635-2650), table III, method 10.
  const auto interval = [](int both, int a, int b, int neither) {
    return NewcombePairedInterval({.both = both, .only_a = a, .only_b = b, .neither = neither});
  };
  ExpectInterval(interval(36, 12, 2, 0), 0.0569, 0.3404, 5e-5);
  ExpectInterval(interval(20, 12, 2, 16), 0.0562, 0.3292, 5e-5);
  ExpectInterval(interval(18, 12, 2, 18), 0.0562, 0.3290, 5e-5);
  ExpectInterval(interval(36, 14, 0, 0), 0.1528, 0.4167, 5e-5);
  ExpectInterval(interval(35, 14, 0, 1), 0.1461, 0.4175, 5e-5);
  ExpectInterval(interval(2, 97, 1, 0), 0.8721, 0.9854, 5e-5);
  ExpectInterval(interval(0, 30, 0, 0), 0.8395, 1, 5e-5);
  ExpectInterval(interval(54, 0, 0, 0), -0.0664, 0.0664, 5e-5);
  ExpectInterval(interval(30, 0, 0, 24), -0.0358, 0.0358, 5e-5);
  ExpectInterval(interval(0, 0, 0, 0), -1, 1, 0);
  // In this mirrored case, a and b are exchanged.
  ExpectInterval(interval(20, 2, 12, 16), -0.3292, -0.0562, 5e-5);
  // For uncorrelated pairs, the interval equals the interval of independent samples.
  const Interval independent = NewcombeInterval(10, 20, 10, 20);
  ExpectInterval(interval(5, 5, 5, 5), independent.lower, independent.upper, 1e-12);
}

TEST(McNemarTest, CountsCoins) {
  EXPECT_NEAR(McNemarTest(12, 3), 0.0351563, 6e-8);
  EXPECT_DOUBLE_EQ(McNemarTest(3, 12), McNemarTest(12, 3));
  EXPECT_DOUBLE_EQ(McNemarTest(6, 0), 2.0 / 64);
  EXPECT_DOUBLE_EQ(McNemarTest(5, 0), 2.0 / 32);
  EXPECT_DOUBLE_EQ(McNemarTest(4, 4), 1);
  EXPECT_DOUBLE_EQ(McNemarTest(0, 0), 1);
}

TEST(FisherTest, TeaTasting) {
  EXPECT_NEAR(FisherTest(3, 4, 1, 4), 34.0 / 70, 1e-12);
  EXPECT_NEAR(FisherTest(4, 4, 0, 4), 2.0 / 70, 1e-12);
  EXPECT_EQ(FisherTest(0, 0, 3, 4), 1);
  EXPECT_EQ(FisherTest(5, 5, 7, 7), 1);
}

TEST(FisherTest, AgreesWithCountingTables) {
  for (const auto& [a, m, b, n] :
       {std::tuple(43, 50, 31, 50), {2, 9, 7, 11}, {0, 8, 5, 30}, {10, 12, 1, 7}}) {
    const auto ways = [&, m = m, n = n, sum = a + b](int k) {
      return k < 0 || k > m || sum - k < 0 || sum - k > n
                 ? 0.0
                 : BinomialCoefficient(m, k) * BinomialCoefficient(n, sum - k);
    };
    double no_likelier = 0, all = 0;
    for (int k = 0; k <= m; ++k) {
      all += ways(k);
      if (ways(k) <= ways(a) * (1 + 1e-9)) no_likelier += ways(k);
    }
    EXPECT_NEAR(FisherTest(a, m, b, n), no_likelier / all, 1e-10);
  }
}

// Returns the two-sided p over all 2^n signs, computed from the definition, with ranks found by comparison.
double SignedRankByEnumeration(const Values& differences) {
  Values sizes;
  for (const double d : differences) {
    if (d != 0) sizes.push_back(d);
  }
  const auto rank = [&](double d) {
    double smaller = 0, equal = 0;
    for (const double other : sizes) {
      smaller += std::abs(other) < std::abs(d);
      equal += std::abs(other) == std::abs(d);
    }
    return smaller + (equal + 1) / 2;
  };
  double observed = 0;
  for (const double d : sizes) observed += d > 0 ? rank(d) : 0;
  double lower = 0, upper = 0;
  for (unsigned signs = 0; signs < 1u << sizes.size(); ++signs) {
    double sum = 0;
    for (size_t i = 0; i < sizes.size(); ++i) sum += signs >> i & 1 ? rank(sizes[i]) : 0;
    lower += sum <= observed;
    upper += sum >= observed;
  }
  return std::min(1.0, 2 * std::min(lower, upper) / std::pow(2, static_cast<double>(sizes.size())));
}

TEST(WilcoxonSignedRankTest, DepressionScalesOfHollanderAndWolfe) {
  const Values before = {1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30};
  const Values after = {0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29};
  Values differences;
  for (size_t i = 0; i < before.size(); ++i) differences.push_back(before[i] - after[i]);
  const RankTest test = WilcoxonSignedRankTest(differences);
  EXPECT_EQ(test.statistic, 40);
  EXPECT_TRUE(test.exact);
  EXPECT_NEAR(test.p / 2, 0.0195313, 6e-8);  // published as one-sided
}

TEST(WilcoxonSignedRankTest, EqualDifferencesOfTimesAreEqual) {
  // The differences 0.06, -0.14, -0.26, 0.14, 0.14 have ranks 1, 3, 5, 3, 3, so the statistic is 7 of 15.
  // Half of all sign patterns give no more.
  const Values a = {4.66, 5.06, 5.20, 5.80, 5.88}, b = {4.60, 5.20, 5.46, 5.66, 5.74};
  Values differences;
  for (size_t i = 0; i < a.size(); ++i) differences.push_back(a[i] - b[i]);
  EXPECT_NE(-differences[1], differences[3]);
  EXPECT_EQ(WilcoxonSignedRankTest(differences).statistic, 7);
  EXPECT_EQ(WilcoxonSignedRankTest(differences).p, 1);
  EXPECT_EQ(WilcoxonSignedRankTest(PairedDifferences(b, a)).p, 1);
}

TEST(WilcoxonSignedRankTest, RoundingIsNoDifference) {
  EXPECT_EQ(PairedDifferences(Values{0.1 + 0.2, 1, 7}, Values{0.3, 1, 5}), (Values{0, 0, 2}));
  // Three ticks of 1/500 s added to an hour are not lost by rounding.
  EXPECT_NEAR(PairedDifferences(Values{3600.006}, Values{3600})[0], 0.006, 1e-12);
}

// One of the 2^n choices of signs of n different pairs is the most extreme in each direction.
TEST(WilcoxonSignedRankTest, LeastPIsOfTheMostExtremeSigns) {
  EXPECT_EQ(WilcoxonSignedRankTest(Values{1, -2, 3, -4, 5}).least_p, 2.0 / 32);
  EXPECT_EQ(WilcoxonSignedRankTest(Values{1, -2, 0, 0, 0, 0, 0}).least_p, 2.0 / 4);
  EXPECT_EQ(WilcoxonSignedRankTest(Values(51, 1.0)).least_p, 0);
  EXPECT_EQ(WilcoxonSignedRankTest({}).least_p, 1);
}

// Two of five values can be chosen in 10 ways. If the two least values are equal to a third, 3 of these ways
// yield the least rank sum, but only one the highest.
TEST(MannWhitneyTest, LeastPIsOfTheMostExtremeSamples) {
  EXPECT_EQ(MannWhitneyTest(Values{1, 5}, Values{2, 3, 4}).least_p, 2.0 / 10);
  EXPECT_EQ(MannWhitneyTest(Values{1, 5}, Values{1, 1, 4}).least_p, 2.0 / 10);
  EXPECT_EQ(MannWhitneyTest(Values{1}, Values{1, 1}).least_p, 1);
}

TEST(WilcoxonSignedRankTest, AgreesWithEnumeration) {
  const std::vector<Values> samples = {
      {1, 2, 3, -4, 5},
      {1, 1, 1, 1, 1},                 // all tied
      {0, 0, 2, -1, 3, 0, 4},          // zeros
      {1, -1, 2, -2, 2, 3, 3, 3, -5},  // ties of both signs
      {0.5, 0.25, -3, 7, 8, 9, -0.125, 4, 11, 13, -2, 6},
  };
  for (const Values& sample : samples)
    EXPECT_NEAR(WilcoxonSignedRankTest(sample).p, SignedRankByEnumeration(sample), 1e-12);
  EXPECT_EQ(WilcoxonSignedRankTest(Values{0, 0, 0}).p, 1);
  EXPECT_EQ(WilcoxonSignedRankTest({}).p, 1);
}

TEST(WilcoxonSignedRankTest, NormalBeyondFifty) {
  // The values are 1, -2, 3, -4, ..., 51. The positive ranks 1 + 3 + ... + 51 sum to 676; the mean is 663 and
  // the variance 51 52 103 / 24 = 11381.5.
  Values x;
  for (int i = 1; i <= 51; ++i) x.push_back(i % 2 ? i : -i);
  const RankTest test = WilcoxonSignedRankTest(x);
  EXPECT_FALSE(test.exact);
  EXPECT_EQ(test.statistic, 676);
  EXPECT_NEAR(test.p, std::erfc(12.5 / std::sqrt(11381.5) / std::sqrt(2)), 1e-12);
  // At the transition, the approximation nearly equals the exact distribution.
  x.back() = 0;
  const double exact = WilcoxonSignedRankTest(x).p;
  EXPECT_NEAR(NormalTwoSided(625, 637.5, 50 * 51 * 101 / 24.0), exact, 2e-3);
}

// Computes p over all ways to choose sample a from the values.
double RankSumByEnumeration(const Values& a, const Values& b) {
  Values all = a;
  all.insert(all.end(), b.begin(), b.end());
  const auto u = [&](const std::vector<bool>& in_a) {
    double wins = 0;
    for (size_t i = 0; i < all.size(); ++i) {
      for (size_t j = 0; j < all.size(); ++j) {
        if (in_a[i] && !in_a[j]) wins += all[i] > all[j] ? 1 : all[i] == all[j] ? 0.5 : 0;
      }
    }
    return wins;
  };
  std::vector<bool> in_a(all.size(), false);
  std::fill_n(in_a.begin(), a.size(), true);
  const double observed = u(in_a);
  double lower = 0, upper = 0, ways = 0;
  do {
    const double value = u(in_a);
    ++ways;
    lower += value <= observed;
    upper += value >= observed;
  } while (std::prev_permutation(in_a.begin(), in_a.end()));
  return std::min(1.0, 2 * std::min(lower, upper) / ways);
}

TEST(MannWhitneyTest, PermeabilityOfHollanderAndWolfe) {
  const Values a = {0.80, 0.83, 1.89, 1.04, 1.45, 1.38, 1.91, 1.64, 0.73, 1.46};
  const Values b = {1.15, 0.88, 0.90, 0.74, 1.21};
  const RankTest test = MannWhitneyTest(a, b);
  EXPECT_EQ(test.statistic, 35);
  EXPECT_TRUE(test.exact);
  EXPECT_NEAR(test.p / 2, 0.1272, 5e-5);  // published as one-sided
}

TEST(MannWhitneyTest, EqualNumbersInSpiteOfRounding) {
  // Both samples contain 0.3, so U = 1/2 + 1 of 2, and every choice of the three values has a U at least as
  // far from 1.
  const RankTest test = MannWhitneyTest(Values{0.1 + 0.2}, Values{0.3, 0.2});
  EXPECT_EQ(test.statistic, 1.5);
  EXPECT_EQ(MannWhitneyTest(Values{0.3}, Values{0.1 + 0.2, 0.2}).statistic, 1.5);
}

TEST(MannWhitneyTest, AgreesWithEnumeration) {
  const std::vector<std::pair<Values, Values>> samples = {
      {{1, 4, 6}, {2, 3, 5, 7}},
      {{0, 0, 1, 2}, {0, 3, 3, 3, 5}},  // ties
      {{1, 1}, {1, 1, 1}},              // only ties
      {{10, 11, 12, 13}, {1, 2, 3, 4, 5}},
  };
  for (const auto& [a, b] : samples) {
    EXPECT_NEAR(MannWhitneyTest(a, b).p, RankSumByEnumeration(a, b), 1e-12);
    EXPECT_NEAR(MannWhitneyTest(b, a).p, RankSumByEnumeration(a, b), 1e-12);
  }
  EXPECT_EQ(MannWhitneyTest({}, Values{1}).p, 1);
}

TEST(MannWhitneyTest, NormalBeyondFifty) {
  // For 0, 2, 4, ... against 1, 3, 5, ..., U = 0 + 1 + ... + 25 = 325. Its mean is 338 and its variance 26 26
  // 53 / 12.
  Values a, b;
  for (int i = 0; i < 26; ++i) {
    a.push_back(2 * i);
    b.push_back(2 * i + 1);
  }
  const RankTest test = MannWhitneyTest(a, b);
  EXPECT_FALSE(test.exact);
  EXPECT_EQ(test.statistic, 325);
  EXPECT_NEAR(test.p, std::erfc(12.5 / std::sqrt(26 * 26 * 53 / 12.0) / std::sqrt(2)), 1e-12);
}

TEST(HolmAdjusted, PublishedValues) {
  const Values adjusted = HolmAdjusted({.01, .04, .03, .005});
  const Values expected = {.03, .06, .06, .02};
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(adjusted[i], expected[i], 1e-15);
  EXPECT_EQ(HolmAdjusted({0.4, 0.7}), (Values{0.8, 0.8}));
  EXPECT_EQ(HolmAdjusted({0.9, 0.7}), (Values{1, 1}));
  EXPECT_TRUE(HolmAdjusted({}).empty());
}

// Survival times of the treated mice in Efron and Tibshirani 1993, table 2.1.
const Values kMice = {94, 197, 16, 38, 99, 141, 23};

// Returns the means of all 7^7 resamples, which are the exact bootstrap distribution.
Values AllResampledMeans() {
  Values means;
  for (int code = 0; code < 823543; ++code) {
    double sum = 0;
    for (int i = 0, rest = code; i < 7; ++i, rest /= 7) sum += kMice[static_cast<size_t>(rest % 7)];
    means.push_back(sum / 7);
  }
  return means;
}

TEST(Bootstrap, MiceByAllResamples) {
  const Values all = AllResampledMeans();
  EXPECT_NEAR(StandardDeviation(all), 23.36, 5e-3);
  const Interval percentile = PercentileInterval(all);
  ExpectInterval(percentile, 43.4, 134.4, 0.6);
  Moments moments;
  moments.Add(kMice, 1);
  ExpectInterval(BcaInterval(all, Mean(kMice), moments.acceleration(), 0), 46.3, 138.3, 0.6);
}

// The seven values have mean 608 / 7 and variance 4457.810. The quantile of t with 6 degrees of freedom is
// 2.446912.
TEST(IntervalOfMean, OfFewIsStudents) {
  const double error = std::sqrt(4457.8095238 / 7), mean = 608.0 / 7;
  ExpectInterval(IntervalOfMean(kMice), mean - 2.446911851 * error, mean + 2.446911851 * error, 1e-5);
}

// Welch's test has variances 1 and 16, n = 3 and 5, and s = sqrt(1/3 + 16/5). The degrees of freedom are (1/3
// + 16/5)^2 / ((1/3)^2 / 2 + (16/5)^2 / 4) = 4.773. The quantile of t is 2.607766 (by integration of its
// density).
TEST(IntervalOfMean, OfTwoSmallSamplesIsWelchs) {
  const Values a = {1, 2, 3}, b = {6, 10, 10, 10, 14};
  EXPECT_DOUBLE_EQ(std::pow(StandardDeviation(b), 2), 8);
  const Values wide = {10 - std::sqrt(32.0), 10, 10, 10, 10 + std::sqrt(32.0)};
  const double error = std::sqrt(1.0 / 3 + 16.0 / 5);
  ExpectInterval(IntervalOfDifference(a, wide), -8 - 2.6077657 * error, -8 + 2.6077657 * error, 1e-5);
}

TEST(Bootstrap, FollowsShiftScaleAndMirror) {
  Values x, moved, mirrored;
  std::mt19937 random(5);
  for (int i = 0; i < 40; ++i) x.push_back(std::exp(std::normal_distribution<>()(random)));
  for (const double value : x) {
    moved.push_back(3 * value + 2);
    mirrored.push_back(-value);
  }
  const Interval interval = IntervalOfMean(x);
  ExpectInterval(IntervalOfMean(moved), 3 * interval.lower + 2, 3 * interval.upper + 2, 1e-9);
  ExpectInterval(IntervalOfMean(mirrored), -interval.upper, -interval.lower, 1e-9);
  // The values are right-skewed, so BCa extends farther up than down.
  EXPECT_GT(interval.upper - Mean(x), 1.15 * (Mean(x) - interval.lower));
}

// Slightly above kMaxToResample, the result equals resampling (done in this test) up to a fiftieth of the
// interval's width, even for skewed values.
TEST(Bootstrap, ManyValuesAreNotResampled) {
  std::mt19937_64 engine(7);
  std::vector<double> x(kMaxToResample + 1), y(x.size());
  for (size_t i = 0; i < x.size(); ++i) {
    const double u = static_cast<double>(engine() >> 11) * 0x1p-53;
    x[i] = u * u * u * u;
    y[i] = 0.5 + static_cast<double>(engine() >> 11) * 0x1p-53;
  }
  Resampler resampler;
  std::vector<double> means(kResamples);
  for (double& mean : means) mean = resampler.Mean(x);
  Moments moments;
  moments.Add(x, 1);
  const Interval drawn = BcaInterval(means, Mean(x), moments.acceleration(), 0);
  const double width = drawn.upper - drawn.lower;
  ExpectInterval(IntervalOfMean(x), drawn.lower, drawn.upper, width / 50);

  std::vector<double> differences(kResamples), ratios(kResamples);
  for (size_t k = 0; k < differences.size(); ++k) {
    const double mean_x = resampler.Mean(x);
    differences[k] = mean_x - resampler.Mean(y);
    double sum_x = 0, sum_y = 0;
    resampler.Draw(x.size(), [&](size_t i) {
      sum_x += x[i];
      sum_y += y[i];
    });
    ratios[k] = sum_x / sum_y;
  }
  const Interval difference = PercentileInterval(differences), ratio = PercentileInterval(ratios);
  ExpectInterval(IntervalOfDifference(x, y), difference.lower, difference.upper,
                 (difference.upper - difference.lower) / 50);
  ExpectInterval(IntervalOfRatio(x, y), ratio.lower, ratio.upper, (ratio.upper - ratio.lower) / 50);
}

TEST(Bootstrap, NothingHangsOnTheLastBitsOfASum) {
  const double third = 1.0 / 3;
  const Values x = {0, 0, 0, -third, 0, -third, -third, 0, 0, 0, -third, -third};
  Values whole;
  for (const double value : x) whole.push_back(3 * value);
  const Interval interval = IntervalOfMean(x);
  ExpectInterval(IntervalOfMean(whole), 3 * interval.lower, 3 * interval.upper, 1e-9);
  const Values other = {third, 0, third, 0, 0, third, 0, 0, 0, 0};
  Values other_whole;
  for (const double value : other) other_whole.push_back(3 * value);
  const Interval difference = IntervalOfDifference(x, other);
  ExpectInterval(IntervalOfDifference(whole, other_whole), 3 * difference.lower, 3 * difference.upper, 1e-9);
  // Values that differ only by rounding count as one value.
  Values same(12, 0.3);
  same[5] = 0.1 + 0.2;
  EXPECT_TRUE(std::isnan(IntervalOfMean(same).lower));
}

TEST(Bootstrap, CoversTheMean) {
  std::mt19937_64 random(11);
  std::exponential_distribution<> exponential;
  int covered = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Values x(30);
    for (double& value : x) value = exponential(random);
    const Interval interval = IntervalOfMean(x);
    covered += interval.lower <= 1 && 1 <= interval.upper;
  }
  // With 30 values of this distribution, BCa covers 92 to 93 %. 200 trials are off by at most 4 points.
  EXPECT_GE(covered, 176);
  EXPECT_LE(covered, 196);
}

TEST(Bootstrap, OfLittle) {
  EXPECT_TRUE(std::isnan(IntervalOfMean(Values{3}).lower));
  EXPECT_TRUE(std::isnan(IntervalOfMean({}).upper));
  // Equal values do not reveal their variance.
  EXPECT_TRUE(std::isnan(IntervalOfMean(Values(20, 0.1)).lower));
  EXPECT_TRUE(std::isnan(IntervalOfMean(Values(600, 0.1)).lower));
  EXPECT_TRUE(std::isnan(IntervalOfDifference(Values{3}, Values{1, 2}).lower));
  EXPECT_TRUE(std::isnan(IntervalOfDifference(Values(12, 5), Values(15, 3)).lower));
  EXPECT_TRUE(std::isnan(IntervalOfRatio(Values(12, 5), Values(12, 2)).lower));
  Values rarely(25, 0), some(25, 1);
  rarely[3] = some[3] = 2;
  EXPECT_TRUE(std::isnan(IntervalOfRatio(some, rarely).lower));
  EXPECT_TRUE(std::isnan(IntervalOfRatio(Values{1, 2}, Values{0, 0}).lower));
}

TEST(Bootstrap, DifferencesOfLargeSamplesAreNormal) {
  Values a, b;
  for (int i = 0; i < 400; ++i) a.push_back(10 + std::sin(i));
  for (int i = 0; i < 300; ++i) b.push_back(9 + 2 * std::cos(3 * i));
  const double difference = Mean(a) - Mean(b);
  const double error = std::hypot(StandardDeviation(a) / 20, StandardDeviation(b) / std::sqrt(300));
  ExpectInterval(IntervalOfDifference(a, b), difference - kNormal975 * error, difference + kNormal975 * error,
                 0.06 * error);
}

TEST(Bootstrap, RatioOfPairs) {
  // The values are twice the baseline except for a small disturbance. The delta method gives the expected
  // interval.
  Values a, b;
  for (int i = 0; i < 200; ++i) {
    b.push_back(5 + std::sin(i));
    a.push_back(2 * b.back() + 0.5 * std::cos(7 * i));
  }
  Values rest;
  const double ratio = Mean(a) / Mean(b);
  for (size_t i = 0; i < a.size(); ++i) rest.push_back((a[i] - ratio * b[i]) / Mean(b));
  const double error = StandardDeviation(rest) / std::sqrt(200);
  ExpectInterval(IntervalOfRatio(a, b), ratio - kNormal975 * error, ratio + kNormal975 * error, 0.08 * error);
}

}  // namespace evalbus::metrics::statistics_test
