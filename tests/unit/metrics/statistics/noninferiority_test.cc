// Compares the tests that `evalbus gate` uses for success rates and means with hand-computed values, sums
// over all outcomes by an independent method, and simulated error rates with fixed random numbers.
// EVALBUS_SIMULATIONS=10000 gives the figures of docs/gate.md, which the tests print.
#include "metrics/statistics/noninferiority.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "metrics/statistics/bounds_of_mean.h"

namespace evalbus::metrics::noninferiority_test {

using Engine = std::mt19937_64;

int Simulations() {
  const char* const asked = std::getenv("EVALBUS_SIMULATIONS");
  return asked ? std::max(1, std::atoi(asked)) : 300;
}

double Uniform(Engine& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }
double Normal(Engine& random) { return std::normal_distribution<>()(random); }

// Returns the most errors that a true error rate of 5 % gives in this many simulations, except with a chance
// of 3e-5.
double MostErrors(int simulations, double rate = 0.05) {
  return rate * simulations + 4 * std::sqrt(rate * (1 - rate) * simulations);
}

// In the published example (Tango 1998, section 6), soft contact lenses were compared in 44 pairs, of which
// the standard won one. For a difference of -0.1, z = 1.709.
TEST(PairedScore, IsTangosExample) { EXPECT_NEAR(PairedScore({44, 0, 1}, -0.1), 1.709, 5e-4); }

// Without discordant pairs the variance is n d (1 - d), so the score is sqrt(n d / (1 - d)).
TEST(PairedScore, OfEqualPairs) {
  EXPECT_NEAR(PairedScore({100, 0, 0}, -0.05), std::sqrt(100 * 0.05 / 0.95), 1e-12);
  EXPECT_EQ(PairedScore({100, 0, 0}, 0), 0);
  EXPECT_EQ(PairedScore({100, 7, 7}, 0), 0);
  EXPECT_NEAR(PairedScore({100, 9, 4}, 0), 5 / std::sqrt(13.0), 1e-12);  // McNemar's statistic
}

// Without discordant pairs, only this outcome has such a high score. At the share d of b, its probability is
// (1 - d)^n.
TEST(PairedAbove, EqualPairsPassFromFiftyNineOn) {
  EXPECT_NEAR(PairedAboveTest({58, 0, 0}, -0.05), std::pow(0.95, 58), 1e-9);
  EXPECT_FALSE(TestPairedAbove({58, 0, 0}, -0.05, 0.05).is_above);
  EXPECT_TRUE(TestPairedAbove({59, 0, 0}, -0.05, 0.05).is_above);
  EXPECT_NEAR(TestPairedAbove({100, 0, 0}, -0.05, 0.05).lower, -(1 - std::pow(0.05, 0.01)), 1e-4);
}

TEST(PairedAbove, WithoutPairsNothingIsShown) {
  EXPECT_EQ(PairedAboveTest({0, 0, 0}, -0.05), 1);
  EXPECT_FALSE(TestPairedAbove({0, 0, 0}, -0.05, 0.05).is_above);
}

// Returns the probability of all outcomes whose score is at least as high, summed over all outcomes.
double Probability(int n, double score, double d, double share_b) {
  const double share_a = share_b + d, share_none = 1 - share_a - share_b;
  double sum = 0;
  for (int a = 0; a <= n; ++a) {
    for (int b = 0; a + b <= n; ++b) {
      if (PairedScore({n, a, b}, d) < score - 1e-9) continue;
      sum += std::exp(std::lgamma(n + 1) - std::lgamma(a + 1) - std::lgamma(b + 1) -
                      std::lgamma(n - a - b + 1)) *
             std::pow(share_a, a) * std::pow(share_b, b) * std::pow(share_none, n - a - b);
    }
  }
  return sum;
}

TEST(PairedAbove, IsTheLargestSumOverAllOutcomes) {
  for (const Discordant counts : {Discordant{12, 3, 1}, {12, 0, 2}, {15, 5, 5}, {15, 1, 6}}) {
    for (const double d : {-0.2, -0.05, 0.0, 0.1}) {
      const double score = PairedScore(counts, d), least = std::max(0.0, -d);
      double largest = 0;
      for (int i = 0; i <= 2000; ++i)
        largest =
            std::max(largest, Probability(counts.pairs, score, d, least + i * ((1 - d) / 2 - least) / 2000));
      EXPECT_NEAR(PairedAboveTest(counts, d), largest, 2e-5)
          << counts.pairs << " " << counts.only_a << " " << counts.only_b << " " << d;
    }
  }
}

TEST(PairedAbove, TheBoundAgreesWithTheTest) {
  for (int a = 0; a <= 20; a += 4) {
    for (int b = 0; a + b <= 40; b += 4) {
      const PairedAbove result = TestPairedAbove({40, a, b}, -0.1, 0.05);
      EXPECT_EQ(result.is_above, result.lower >= -0.1) << a << " " << b;
      EXPECT_LE(result.lower, (a - b) / 40.0);
    }
  }
}

// Above kMaxPairsForExact, the normal approximation nearly continues the exact p.
TEST(PairedAbove, ManyPairsAreApproximated) {
  EXPECT_NEAR(PairedAboveTest({kMaxPairsForExact, 200, 260}, -0.05),
              PairedAboveTest({kMaxPairsForExact + 1, 200, 260}, -0.05), 0.003);
}

TEST(PairsNeeded, AreThoseOfEqualPairsAtLeast) {
  EXPECT_EQ(PairsNeeded({0, 0}, -0.05, 0.05), 59);
  EXPECT_EQ(PairsNeeded({0.05, 0.1}, -0.05, 0.05), std::nullopt);  // the difference equals the margin
  EXPECT_EQ(PairsNeeded({0.05, 0.11}, -0.05, 0.05), std::nullopt);
}

// Caches the decision for each outcome. p decreases with the score, so few values of p decide all outcomes.
class Decisions {
 public:
  Decisions(int pairs, double margin) : pairs_(pairs), margin_(margin) {}
  bool Passes(int a, int b) { return Rejects({pairs_, a, b}, -margin_, &passes_); }
  bool Fails(int a, int b) { return Rejects({pairs_, b, a}, margin_, &fails_); }

 private:
  struct Known {
    double accepted = -1e9, rejected = 1e9;
  };
  static bool Rejects(const Discordant& counts, double difference, Known* known) {
    const double score = PairedScore(counts, difference);
    if (score > known->accepted && score < known->rejected) {
      const bool rejects = PairedAboveTest(counts, difference) <= kAlpha;
      (rejects ? known->rejected : known->accepted) = score;
    }
    return score >= known->rejected;
  }
  int pairs_;
  double margin_;
  Known passes_, fails_;
};

// Returns the probabilities of PASS and FAIL, summed over all outcomes.
std::pair<double, double> ExactRates(int n, const DiscordantShares& shares, Decisions* decisions) {
  const double none = 1 - shares.only_a - shares.only_b;
  double passes = 0, fails = 0;
  for (int a = 0; a <= n; ++a) {
    for (int b = 0; a + b <= n; ++b) {
      const double probability = std::exp(std::lgamma(n + 1) - std::lgamma(a + 1) - std::lgamma(b + 1) -
                                          std::lgamma(n - a - b + 1)) *
                                 std::pow(shares.only_a, a) * std::pow(shares.only_b, b) *
                                 std::pow(none, n - a - b);
      if (probability < 1e-9) continue;
      passes += probability * decisions->Passes(a, b);
      fails += probability * decisions->Fails(a, b);
    }
  }
  return {passes, fails};
}

// Returns the shares of pairs for a baseline's rate b, a rate a = b + difference, and a correlation of the
// outcomes. The shares are limited to their range.
DiscordantShares SharesOf(double base, double difference, double correlation) {
  const double rate = base + difference;
  const double both = std::clamp(rate * base + correlation * std::sqrt(rate * (1 - rate) * base * (1 - base)),
                                 std::max(0.0, rate + base - 1), std::min(rate, base));
  return {rate - both, base - both};
}

TEST(GateErrorRate, OfSuccess) {
  const int simulations = Simulations();
  for (const int n : {20, 50, 100, 200}) {
    for (const double margin : {0.05, 0.1}) {
      Decisions decisions(n, margin);
      double worst_pass = 0, worst_fail = 0, exact_pass = 0, exact_fail = 0;
      for (const double base : {0.2, 0.5, 0.8, 0.95}) {
        for (const double correlation : {0.0, 0.3, 0.7}) {
          const DiscordantShares shares = SharesOf(base, -margin, correlation);
          Engine random(11);
          int passes = 0, fails = 0;
          for (int i = 0; i < simulations; ++i) {
            int a = 0, b = 0;
            for (int k = 0; k < n; ++k) {
              const double drawn = Uniform(random);
              a += drawn < shares.only_a;
              b += drawn >= shares.only_a && drawn < shares.only_a + shares.only_b;
            }
            passes += decisions.Passes(a, b);
            fails += decisions.Fails(a, b);
          }
          EXPECT_LE(passes, MostErrors(simulations))
              << n << " " << margin << " " << base << " " << correlation;
          EXPECT_LE(fails, MostErrors(simulations))
              << n << " " << margin << " " << base << " " << correlation;
          worst_pass = std::max(worst_pass, 100.0 * passes / simulations);
          worst_fail = std::max(worst_fail, 100.0 * fails / simulations);
          const auto [pass, fail] = ExactRates(n, shares, &decisions);
          EXPECT_LE(std::max(pass, fail), kAlpha + 1e-4) << n << " " << margin << " " << base;
          exact_pass = std::max(exact_pass, 100 * pass);
          exact_fail = std::max(exact_fail, 100 * fail);
        }
      }
      std::printf("| %d | %.0f points | %.1f %% (%.1f %%) | %.1f %% (%.1f %%) |\n", n, 100 * margin,
                  worst_pass, exact_pass, worst_fail, exact_fail);
    }
  }
}

struct Kind {
  const char* name;
  // Draws both values of a pair, whose means are equal.
  std::function<std::pair<double, double>(Engine&)> draw;
  // Error rate that docs/gate.md states.
  double most = 0.05;
};
const Kind kKinds[] = {
    {"normal, correlated",
     [](Engine& r) {
       const double start = Normal(r);
       return std::pair(start + Normal(r), start + Normal(r));
     }},
    {"lognormal, sigma 0.7",
     [](Engine& r) { return std::pair(std::exp(0.7 * Normal(r)), std::exp(0.7 * Normal(r))); }},
    {"lognormal against its mean, sigma 1",
     [](Engine& r) { return std::pair(std::exp(Normal(r)), std::exp(0.5)); }, 0.1},
    {"counts of mean 0.3",
     [](Engine& r) {
       std::poisson_distribution<> count(0.3);
       const double a = count(r), b = count(r);
       return std::pair(a, b);
     }},
    // One policy has many small values, and the other has few large ones of the same mean.
    {"few large against many small",
     [](Engine& r) { return std::pair(Uniform(r) < 0.2 ? 3.0 : 0.0, Uniform(r) < 0.6 ? 1.0 : 0.0); }},
    {"progress in quarters",
     [](Engine& r) {
       const auto progress = [&r] { return Uniform(r) < 0.7 ? 1 : std::floor(4 * Uniform(r)) / 4; };
       const double a = progress(), b = progress();
       return std::pair(a, b);
     }},
};

TEST(GateErrorRate, OfMeans) {
  const int simulations = Simulations();
  for (const Kind& kind : kKinds) {
    for (const int n : {20, 50, 100, 200}) {
      Engine random(12);
      int below = 0, above = 0;
      for (int i = 0; i < simulations; ++i) {
        std::vector<double> differences;
        for (int k = 0; k < n; ++k) {
          const auto [a, b] = kind.draw(random);
          differences.push_back(a - b);
        }
        const Interval bounds = BoundsOfMean(differences, kAlpha);
        below += bounds.upper < 0;
        above += bounds.lower > 0;
      }
      EXPECT_LE(below, MostErrors(simulations, kind.most)) << kind.name << " " << n;
      EXPECT_LE(above, MostErrors(simulations, kind.most)) << kind.name << " " << n;
      std::printf("| %s | %d | %.1f %% | %.1f %% |\n", kind.name, n, 100.0 * below / simulations,
                  100.0 * above / simulations);
    }
  }
}

TEST(GatePower, OfSuccess) {
  constexpr double kMargin = 0.05;
  for (const int n : {50, 100, 200, 400}) {
    Decisions decisions(n, kMargin);
    for (const double base : {0.5, 0.9}) {
      std::printf("| %d | %.0f %% |", n, 100 * base);
      double before = 0;
      for (const double difference : {-0.2, -0.1, -0.05, 0.0, 0.05}) {
        const DiscordantShares shares = SharesOf(base, difference, 0.3);
        const auto [passes, fails] = ExactRates(n, shares, &decisions);
        std::printf(" %.0f / %.0f |", 100 * passes, 100 * fails);
        EXPECT_GE(passes, before - 1e-6) << "a better policy passes more often";
        before = passes;
        EXPECT_TRUE(difference > -kMargin || passes <= kAlpha + 1e-4) << passes;
        EXPECT_TRUE(difference < -kMargin || fails <= kAlpha + 1e-4) << fails;
      }
      std::printf("\n");
    }
  }
}

TEST(BoundsOfMean, OfSymmetricValuesAreStudents) {
  // The 5 values have mean 0 and standard deviation sqrt(2.5). t(4 degrees, 97.5 %) = 2.776.
  const std::vector<double> x = {-2, -1, 0, 1, 2};
  const Interval bounds = BoundsOfMean(x, 0.05);
  EXPECT_NEAR(bounds.upper, 2.7764 * std::sqrt(2.5 / 5), 1e-4);
  EXPECT_NEAR(bounds.lower, -bounds.upper, 1e-12);
}

TEST(BoundsOfMean, AreWiderTowardTheLongTail) {
  const std::vector<double> x = {0, 0, 0, 0, 1, 0, 0, 0, 0, 5};
  const Interval bounds = BoundsOfMean(x, 0.05);
  const double t = 2.2622 * StandardDeviation(x) / std::sqrt(10.0);
  EXPECT_GT(bounds.upper - 0.6, 1.2 * t);
  EXPECT_NEAR(0.6 - bounds.lower, t, 1e-4);
}

TEST(BoundsOfMean, EqualValuesHaveNone) {
  EXPECT_TRUE(std::isnan(BoundsOfMean(std::vector<double>{1, 1, 1}, 0.05).upper));
  EXPECT_TRUE(std::isnan(BoundsOfMean(std::vector<double>{1}, 0.05).upper));
}

}  // namespace evalbus::metrics::noninferiority_test
