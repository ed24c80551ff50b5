#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <optional>
#include <random>

#include "metrics/statistics/chance_to_decide.h"
#include "metrics/statistics/power.h"
#include "metrics/statistics/sequential_mcnemar.h"

namespace evalbus::metrics::sequential_test {

TEST(SequentialMcNemar, EvidenceIsTheMixtureOverOneHalf) {
  EXPECT_NEAR(EvidenceOf({0, 0}), 1, 1e-12);
  EXPECT_NEAR(EvidenceOf({1, 0}), 1, 1e-12);
  // The evidence of n pairs that the same policy wins is C(2n, n) / 2^n.
  EXPECT_NEAR(EvidenceOf({8, 0}), 12870.0 / 256, 1e-10);
  EXPECT_NEAR(EvidenceOf({0, 8}), 12870.0 / 256, 1e-10);
  // The evidence is the likelihood ratio of a share to 1/2, averaged over share = sin^2(angle) for uniformly
  // distributed angles. Here the average is integrated numerically.
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
  // Looks have 40 % of alpha. At 0.05, 8 pairs are the fewest that decide; their evidence is 50.3.
  EXPECT_NEAR(SequentialP({8, 0}, std::nullopt, false), 256.0 / 12870 / 0.4, 1e-12);
  EXPECT_LT(SequentialP({8, 0}, std::nullopt, false), 0.05);
  EXPECT_GT(SequentialP({7, 0}, std::nullopt, false), 0.05);
  // The last test has 60 % of alpha, so p is 2 / 2^7 / 0.6.
  EXPECT_NEAR(SequentialP({7, 0}, std::nullopt, true), 2.0 / 128 / 0.6, 1e-12);
  EXPECT_EQ(SequentialP({3, 3}, std::nullopt, true), 1);
}

TEST(SequentialMcNemar, ProgressIsAveragedWithSuccess) {
  EXPECT_NEAR(SequentialP({0, 0}, Wins{8, 0}, false), 1 / (0.4 * (1 + 12870.0 / 256) / 2), 1e-12);
  // If pairs differ in progress only, one or two more are needed than if they differ in success.
  EXPECT_GT(SequentialP({0, 0}, Wins{8, 0}, false), 0.05);
  EXPECT_LE(SequentialP({0, 0}, Wins{10, 0}, false), 0.05);
}

// Share of the comparisons that are decided, and mean number of pairs over all comparisons.
struct Simulated {
  double decided = 0, mean_pairs = 0;
};
struct Rates {
  double a, b;
  // Probability that a is ahead of b in a pair with equal success.
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
      // Which policy is ahead is a fair coin toss at every rate, so one rate is enough.
      if (on_progress && rate != 0.5) continue;
      const Simulated equal = Simulate({rate, rate}, 1, 200, 0.05, on_progress);
      std::printf("equal policies, rate %.1f, %s: %.2f %% decided\n", rate,
                  on_progress ? "success and progress" : "success", 100 * equal.decided);
      // 10,000 repetitions have a standard error of 0.2 points.
      EXPECT_LT(equal.decided, 0.05) << rate;
    }
  }
  // The simulation detects tests without correction, which err far more often after every pair.
  EXPECT_GT(Simulate({0.5, 0.5}, 1, 200, 0.5, false).decided, 0.1);
}

TEST(SequentialMcNemar, StopsEarlyWhereItIsClear) {
  const Simulated looks = Simulate({0.9, 0.4}, 1, 200, 0.05, false);
  EXPECT_GT(looks.decided, 0.99);
  EXPECT_LT(looks.mean_pairs, 50);
}

// The policies have equal success rates. In 80 % of the pairs with equal success, one makes more progress or
// is faster.
TEST(SequentialMcNemar, ProgressDecidesWhereSuccessCannot) {
  const Rates rates{0.7, 0.7, 0.8};
  EXPECT_LT(Simulate(rates, 1, 200, 0.05, false).decided, 0.05);
  const Simulated with = Simulate(rates, 1, 200, 0.05, true);
  std::printf("equal success, ahead in 80 %%: decided in %.0f %% after %.0f pairs\n", 100 * with.decided,
              with.mean_pairs);
  EXPECT_GT(with.decided, 0.9);
  EXPECT_LT(with.mean_pairs, 110);
}

// Only one policy succeeds in 15 % of 200 pairs, and only the other one in 5 %. With the exact test at the
// last look, little power is lost compared with a test of a fixed number of pairs.
TEST(SequentialMcNemar, FindsMostOfWhatAFixedTestFinds) {
  const DiscordantShares shares{0.15, 0.05};
  const double fixed = McNemarPower(200, shares), sequential = SequentialPower(10, 200, shares);
  std::printf("15 : 5 of 200 pairs: fixed test %.0f %%, tested every 10 pairs %.0f %%\n", 100 * fixed,
              100 * sequential);
  EXPECT_GT(fixed, 0.86);
  EXPECT_GT(sequential, 0.8);
}

// By hand, if one pair is still to come, the predictive probability that a wins it is (wins + 1/2) / (pairs +
// 3/2).
TEST(ChanceToDecide, IsThePredictiveProbability) {
  const auto of_three = [](const Wins& wins) { return std::max(wins.a, wins.b) >= 3; };
  EXPECT_NEAR(ChanceToDecide({2, 0}, 4, 5, of_three), 2.5 / 5.5, 1e-12);
  EXPECT_NEAR(ChanceToDecide({2, 2}, 4, 5, of_three), 5 / 5.5, 1e-12);
  // Two pairs remain, and three wins decide. Either a wins at least one of the pairs, or b wins both.
  EXPECT_NEAR(ChanceToDecide({2, 1}, 4, 6, of_three), 1 - (1.5 * 2.5 + 2 * 1.5 * 1.5) / (5.5 * 6.5), 1e-12);
  EXPECT_EQ(ChanceToDecide({1, 0}, 4, 5, of_three), 0);
  EXPECT_EQ(ChanceToDecide({3, 0}, 4, 4, of_three), 1);
  EXPECT_NEAR(ChanceToDecide({0, 0}, 0, 300, [](const Wins&) { return true; }), 1, 1e-9);
}

TEST(ChanceToDecide, EndsComparisonsOfPoliciesThatAreAlike) {
  // Neither policy was ever ahead.
  EXPECT_GT(ChanceOfSequentialTest({}, Wins{}, 80, 200, 0.05), kLeastChance);
  EXPECT_LT(ChanceOfSequentialTest({}, Wins{}, 90, 200, 0.05), kLeastChance);
  // With 6 pairs at most, nothing is ever decided.
  EXPECT_EQ(ChanceOfSequentialTest({2, 0}, std::nullopt, 2, 6, 0.05), 0);
  // The first comparison is decided already, and the second one still may be.
  EXPECT_GT(ChanceOfSequentialTest({20, 0}, std::nullopt, 30, 200, 0.05), 0.99);
  EXPECT_GT(ChanceOfSequentialTest({12, 4}, std::nullopt, 80, 200, 0.05), 0.5);
}

// The cost is that at most kLeastChance of all comparisons would have been decided after they were ended
// early.
TEST(ChanceToDecide, CostsFewDecisions) {
  constexpr int kStep = 10, kMost = 200, kRepetitions = 4000;
  std::map<std::array<int, 3>, bool> known;
  const auto is_hopeless = [&](const Wins& wins, int pairs) {
    const auto [entry, is_new] = known.try_emplace({wins.a, wins.b, pairs});
    if (is_new) {
      entry->second = ChanceOfSequentialTest(wins, std::nullopt, pairs, kMost, 0.05) < kLeastChance;
    }
    return entry->second;
  };
  std::mt19937 random(11);
  std::uniform_real_distribution<> uniform;
  // Shares of the pairs in which only a succeeds and in which only b succeeds.
  for (const auto& [only_a, only_b] : {std::pair(0.15, 0.05), {0.1, 0.1}, {0.01, 0.01}}) {
    int decided = 0, decided_too_late = 0;
    double pairs_used = 0, pairs_before = 0;
    for (int i = 0; i < kRepetitions; ++i) {
      Wins wins;
      int ended = 0;
      for (int pair = 1; pair <= kMost; ++pair) {
        const double drawn = uniform(random);
        wins.a += drawn < only_a;
        wins.b += drawn >= only_a && drawn < only_a + only_b;
        if (pair % kStep != 0) continue;
        if (SequentialP(wins, std::nullopt, pair == kMost) <= 0.05) {
          ++decided;
          decided_too_late += ended > 0;
          pairs_before += pair;
          pairs_used += ended > 0 ? ended : pair;
          break;
        }
        if (ended == 0 && pair < kMost && is_hopeless(wins, pair)) ended = pair;
        if (pair == kMost) {
          pairs_before += pair;
          pairs_used += ended > 0 ? ended : pair;
        }
      }
    }
    std::printf("%g : %g: decided %.1f %%, of these ended before %.2f points; %.0f instead of %.0f pairs\n",
                only_a, only_b, 100.0 * decided / kRepetitions, 100.0 * decided_too_late / kRepetitions,
                pairs_used / kRepetitions, pairs_before / kRepetitions);
    EXPECT_LE(decided_too_late, kLeastChance * kRepetitions) << only_a;
  }
}

// The expert is compared with each of nine flaws on each of eight task families: 72 comparisons of at most
// 200 pairs with a look after every ten. The shares were measured by scripts/cause_trials with ten episodes
// each, on equal seeds.
TEST(ChanceToDecide, FlawsNeedFewerEpisodes) {
  struct Kind {
    int comparisons;
    // Shares of the pairs in which only the expert succeeds, in which it is ahead, and in which the flawed
    // policy is ahead.
    double only_expert, expert_ahead, flawed_ahead;
  };
  // In 57 comparisons, the expert always succeeds and the flawed policy never does. In 9 comparisons, the
  // flaw has no effect, such as `drop` if nothing is lifted.
  constexpr Kind kKinds[] = {{57, 1, 1, 0},  {9, 0, 0, 0},     {1, 0.4, 1, 0}, {1, 0.5, 1, 0},
                             {1, 0.1, 1, 0}, {1, 0.3, 0.6, 0}, {1, 0, 1, 0},   {1, 0, 0, 1}};
  constexpr int kStep = 10, kMost = 200, kRepetitions = 50;
  constexpr double kError = 0.05;
  std::mt19937 random(13);
  std::uniform_real_distribution<> uniform;
  // In the previous procedure, the looks had all of alpha, tested only success, and ended only at a decision.
  const auto decides_before = [](const Wins& success) { return EvidenceOf(success) >= 1 / kError; };
  double before = 0, with_success = 0, with_progress = 0;
  for (const Kind& kind : kKinds) {
    for (int i = 0; i < kRepetitions; ++i) {
      Wins success, progress;
      int ended_before = 0, ended_success = 0, ended_progress = 0;
      for (int pair = 1; pair <= kMost; ++pair) {
        const double drawn = uniform(random);
        success.a += drawn < kind.only_expert;
        progress.a += drawn < kind.expert_ahead;
        progress.b += drawn < kind.flawed_ahead;
        if (pair % kStep != 0) continue;
        const bool is_last = pair == kMost;
        const auto ends = [&](const std::optional<Wins>& on) {
          return is_last || SequentialP(success, on, false) <= kError ||
                 ChanceOfSequentialTest(success, on, pair, kMost, kError) < kLeastChance;
        };
        if (ended_before == 0 && (is_last || decides_before(success))) ended_before = pair;
        if (ended_success == 0 && ends(std::nullopt)) ended_success = pair;
        if (ended_progress == 0 && ends(progress)) ended_progress = pair;
      }
      const double weight = kind.comparisons / double{kRepetitions} / 72;
      before += weight * ended_before;
      with_success += weight * ended_success;
      with_progress += weight * ended_progress;
    }
  }
  std::printf("flaws: %.1f pairs on average before, %.1f now (%.0f %%), %.1f on progress (%.0f %%)\n", before,
              with_success, 100 * with_success / before, with_progress, 100 * with_progress / before);
  EXPECT_LT(with_success, 0.6 * before);
  EXPECT_LT(with_progress, 0.55 * before);
}

}  // namespace evalbus::metrics::sequential_test
