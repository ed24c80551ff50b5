// Simulates the coverage of the intervals and the error rates of the tests, with fixed random numbers. By
// default, there are 400 simulations of a case, or 50 if each sample is resampled. EVALBUS_SIMULATIONS=4000
// gives the figures of docs/metrics.md, which the tests print.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>

#include "metrics/statistics/exact_tests.h"
#include "metrics/statistics/interval_of_mean.h"
#include "metrics/statistics/rank_tests.h"
#include "metrics/statistics/run_statistics.h"
#include "metrics/statistics/sequential_mcnemar.h"

namespace evalbus::metrics::coverage_test {

using Values = std::vector<double>;
using Engine = std::mt19937_64;

// There are fewer simulations if each sample of n values is resampled.
int Simulations(int n = 0) {
  const char* const asked = std::getenv("EVALBUS_SIMULATIONS");
  if (asked) return std::max(1, std::atoi(asked));
  return n < static_cast<int>(kFewestToResample) ? 400 : 50;
}
// Returns four standard errors of a share that is estimated from this many simulations.
double Slack(double share, int samples) { return 4 * std::sqrt(share * (1 - share) / std::max(1, samples)); }

double Uniform(Engine& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }
double Normal(Engine& random) { return std::normal_distribution<>()(random); }
double Poisson(Engine& random, double mean) { return std::poisson_distribution<>(mean)(random); }

struct Kind {
  const char* name;
  double mean;
  std::function<double(Engine&)> draw;
};
const Kind kKinds[] = {
    {"normal", 0, Normal},
    {"lognormal, sigma 0.7", std::exp(0.245), [](Engine& r) { return std::exp(0.7 * Normal(r)); }},
    {"counts of mean 0.3", 0.3, [](Engine& r) { return Poisson(r, 0.3); }},
    {"80 % zeros", 0.4, [](Engine& r) { return Uniform(r) < 0.8 ? 0.0 : 1 + Poisson(r, 1); }},
};

// Counts how many intervals contain the true value, and how many samples have an interval.
struct Covered {
  int held = 0, stated = 0, all = 0;
  void Add(const Interval& interval, double truth) {
    ++all;
    if (std::isnan(interval.lower)) return;
    ++stated;
    held += interval.lower <= truth && truth <= interval.upper;
  }
  double share() const { return stated > 0 ? held / static_cast<double>(stated) : 1; }
  void Print(const char* what, int n, const char* kind) const {
    std::printf("%-22s n %3d  %-22s holds the truth in %5.1f %%, none in %5.1f %%\n", what, n, kind,
                100 * share(), 100.0 * (all - stated) / all);
  }
  // Expects at least this share, except for deviations by chance.
  void ExpectAtLeast(double least, const char* kind, int n) const {
    EXPECT_GE(share(), least - Slack(least, stated)) << kind << ", n " << n;
  }
};

TEST(Coverage, MeansOfFewAndMany) {
  for (const Kind& kind : kKinds) {
    for (const int n : {2, 3, 5, 10, 19, 20, 50}) {
      Engine random(5);
      Covered covered;
      for (int i = 0; i < Simulations(n); ++i) {
        Values x(static_cast<size_t>(n));
        for (double& value : x) value = kind.draw(random);
        covered.Add(IntervalOfMean(x), kind.mean);
      }
      covered.Print("mean", n, kind.name);
      covered.ExpectAtLeast(n < 20 && kind.mean == 0 ? 0.95 : 0.86, kind.name, n);
    }
  }
}

TEST(Coverage, DifferencesOfIndependentMeans) {
  for (const Kind& kind : kKinds) {
    for (const int n : {3, 5, 10, 19, 20}) {
      Engine random(6);
      Covered covered;
      for (int i = 0; i < Simulations(n); ++i) {
        // The second sample has twice the spread and one and a half times as many values.
        Values a(static_cast<size_t>(n)), b(static_cast<size_t>(n + n / 2));
        for (double& value : a) value = kind.draw(random);
        for (double& value : b) value = 2 * kind.draw(random);
        covered.Add(IntervalOfDifference(a, b), -kind.mean);
      }
      covered.Print("difference of means", n, kind.name);
      covered.ExpectAtLeast(0.86, kind.name, n);
    }
  }
}

TEST(Coverage, RatiosOfPairs) {
  for (const int n : {3, 5, 10, 19, 20}) {
    Engine random(7);
    Covered covered;
    for (int i = 0; i < Simulations(n); ++i) {
      Values a(static_cast<size_t>(n)), b(a);
      for (size_t k = 0; k < a.size(); ++k) {
        const double start = std::exp(0.3 * Normal(random));
        a[k] = 1.2 * start * std::exp(0.2 * Normal(random));
        b[k] = start * std::exp(0.2 * Normal(random));
      }
      covered.Add(IntervalOfRatio(a, b), 1.2);
    }
    covered.Print("ratio of means of pairs", n, "lognormal");
    covered.ExpectAtLeast(0.87, "ratio", n);
  }
}

EpisodeResult Episode(int start, int starts, bool success) {
  EpisodeResult result;
  result.complete = true;
  result.success = success;
  result.failure_reason = success ? "" : "timeout";
  if (starts > 1) result.parameters = {{"pot_x_m", start}};
  return result;
}

// A variation has few initial states, and the policy behaves the same in each. Repeated initial states are
// drawn independently, so they count. A single initial state that is always the same adds no information.
TEST(Coverage, RatesWhereStartsComeAgain) {
  for (const int starts : {1, 2, 4, 20, 1000}) {
    Engine random(8);
    Covered wilson;
    double samples = 0;
    for (int i = 0; i < Simulations(); ++i) {
      std::vector<bool> outcome;
      double rate = 0;
      for (int start = 0; start < starts; ++start) {
        outcome.push_back(Uniform(random) < 0.7);
        rate += outcome.back() / static_cast<double>(starts);
      }
      RunStatistics statistics;
      for (int episode = 0; episode < 30; ++episode) {
        const int start = static_cast<int>(Uniform(random) * starts);
        statistics.Add(episode, Episode(start, starts, outcome[static_cast<size_t>(start)]));
      }
      const RunSummary summary = statistics.Summary(false);
      wilson.Add(summary.wilson, rate);
      samples += summary.samples;
    }
    wilson.Print("rate, starts that recur", starts, "30 episodes");
    if (starts == 1) {
      EXPECT_EQ(samples, Simulations());
    }
    wilson.ExpectAtLeast(0.94, "starts", starts);
  }
}

// Compares two policies with equal success rates that start from only a few initial states.
TEST(ErrorRate, OfPairsWhereStartsComeAgain) {
  for (const int starts : {2, 4, 20}) {
    Engine random(9);
    int errors = 0;
    for (int i = 0; i < Simulations(); ++i) {
      // b succeeds from the same initial states as a, shifted by one.
      std::vector<bool> a, b;
      for (int start = 0; start < starts; ++start) a.push_back(start < starts / 2);
      for (int start = 0; start < starts; ++start) b.push_back(a[static_cast<size_t>((start + 1) % starts)]);
      int only_a = 0, only_b = 0;
      for (int pair = 0; pair < 30; ++pair) {
        const auto start = static_cast<size_t>(Uniform(random) * starts);
        only_a += a[start] && !b[start];
        only_b += b[start] && !a[start];
      }
      errors += McNemarTest(only_a, only_b) < kAlpha;
    }
    const double share = errors / static_cast<double>(Simulations());
    std::printf("McNemar, %2d starts that recur: %.1f %% wrong\n", starts, 100 * share);
    EXPECT_LE(share, 0.05 + Slack(0.05, Simulations()));
  }
}

// If a plan stops early, the difference of rates that it shows is too large on average. Wilson's interval of
// a rate still contains the true rate in at least 92 % of the simulations.
TEST(Coverage, DifferencesShownByAPlanThatStopsWhenDecided) {
  for (const double difference : {0.1, 0.2, 0.4}) {
    Engine random(11);
    double shown = 0;
    int decided = 0;
    Covered wilson;
    for (int i = 0; i < Simulations(); ++i) {
      int only_a = 0, only_b = 0, successes = 0, pairs = 0;
      do {
        for (int k = 0; k < 10; ++k, ++pairs) {
          const bool a = Uniform(random) < 0.5 + difference / 2, b = Uniform(random) < 0.5 - difference / 2;
          only_a += a && !b;
          only_b += b && !a;
          successes += a;
        }
      } while (pairs < 200 && SequentialP({only_a, only_b}, std::nullopt, false) > kAlpha);
      wilson.Add(WilsonInterval(successes, pairs), 0.5 + difference / 2);
      if (SequentialP({only_a, only_b}, std::nullopt, pairs == 200) > kAlpha) continue;
      ++decided;
      shown += (only_a - only_b) / static_cast<double>(pairs);
    }
    const double mean = shown / std::max(1, decided);
    std::printf("true difference %.0f points: decided in %.0f %%, which show %.0f points on average\n",
                100 * difference, 100.0 * decided / Simulations(), 100 * mean);
    wilson.Print("rate of a plan that stops", 200, "pairs at most");
    EXPECT_GT(mean, difference);
    wilson.ExpectAtLeast(0.92, "stopped", 200);
  }
}

// Stopping by success affects the test of a metric that is equal in both policies and correlated with
// success. Its error rate is slightly above 5 %.
TEST(ErrorRate, OfMetricsOfAPlanThatStopsWhenDecided) {
  for (const double better : {0.5, 0.7}) {
    Engine random(10);
    int errors = 0;
    for (int i = 0; i < Simulations(); ++i) {
      Values differences;
      int only_a = 0, only_b = 0;
      while (differences.size() < 200 &&
             (differences.size() % 20 != 0 || SequentialP({only_a, only_b}, std::nullopt, false) > kAlpha)) {
        const double luck_a = Uniform(random), luck_b = Uniform(random);
        const bool a = luck_a < better, b = luck_b < 0.5;
        only_a += a && !b;
        only_b += b && !a;
        differences.push_back(luck_a - luck_b + 0.3 * Normal(random));
      }
      errors += WilcoxonSignedRankTest(differences).p < kAlpha;
    }
    const double share = errors / static_cast<double>(Simulations());
    std::printf("metric of a plan that stops, rates 0.5 and %.1f: %.1f %% wrong\n", better, 100 * share);
    EXPECT_LE(share, 0.06 + Slack(0.06, Simulations()));
  }
}

}  // namespace evalbus::metrics::coverage_test
