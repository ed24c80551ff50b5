#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metrics/statistics/confidence_sequence.h"
#include "metrics/statistics/sequential_mcnemar.h"

namespace evalbus::metrics::sequential_test {

// (n + 1) C(n, a) / 2^n, computed by hand.
TEST(SequentialMcNemar, IsTheMixtureOverOneHalf) {
  EXPECT_DOUBLE_EQ(SequentialMcNemar(0, 0), 1);
  EXPECT_DOUBLE_EQ(SequentialMcNemar(1, 0), 1);
  EXPECT_NEAR(SequentialMcNemar(8, 0), 9.0 / 256, 1e-15);
  EXPECT_NEAR(SequentialMcNemar(0, 8), 9.0 / 256, 1e-15);
  EXPECT_NEAR(SequentialMcNemar(9, 1), 11.0 * 10 / 1024, 1e-14);
  EXPECT_DOUBLE_EQ(SequentialMcNemar(5, 5), 1);
}

// p below alpha is equivalent to one half being outside of the confidence sequence.
TEST(SequentialMcNemar, AgreesWithTheConfidenceSequence) {
  for (const double alpha : {0.05, 0.01}) {
    for (int a = 0; a <= 30; ++a) {
      for (int b = 0; b <= 30; ++b) {
        const Interval share = ConfidenceSequence(a, a + b, alpha);
        EXPECT_EQ(SequentialMcNemar(a, b) <= alpha, share.lower > 0.5 || share.upper < 0.5) << a << " " << b;
      }
    }
  }
}

// How often a comparison that is tested after every pair is decided, and after how many pairs.
struct Looks {
  double decided = 0, mean_pairs = 0;
};
Looks Simulate(double rate_a, double rate_b, int most, double alpha) {
  constexpr int kRepetitions = 10'000;
  std::mt19937 random(7);
  std::uniform_real_distribution<> uniform;
  int decided = 0;
  double pairs = 0;
  for (int i = 0; i < kRepetitions; ++i) {
    int only_a = 0, only_b = 0, n = 0;
    bool is_decided = false;
    while (n < most && !is_decided) {
      ++n;
      const bool a = uniform(random) < rate_a, b = uniform(random) < rate_b;
      only_a += a && !b;
      only_b += b && !a;
      is_decided = SequentialMcNemar(only_a, only_b) <= alpha;
    }
    decided += is_decided;
    pairs += n;
  }
  return {decided / double{kRepetitions}, pairs / kRepetitions};
}

TEST(SequentialMcNemar, TestingAfterEveryPairKeepsTheErrorRate) {
  for (const double rate : {0.1, 0.5, 0.9}) {
    const Looks looks = Simulate(rate, rate, 200, 0.05);
    // Standard error of 10,000 repetitions: 0.2 points.
    EXPECT_LT(looks.decided, 0.05) << rate;
  }
  // The exact test after every pair, without correction, errs far more often: the simulation detects it.
  EXPECT_GT(Simulate(0.5, 0.5, 200, 0.5).decided, 0.1);
}

TEST(SequentialMcNemar, StopsEarlyWhereItIsClear) {
  const Looks looks = Simulate(0.9, 0.4, 200, 0.05);
  EXPECT_GT(looks.decided, 0.99);
  EXPECT_LT(looks.mean_pairs, 50);
}

}  // namespace evalbus::metrics::sequential_test
