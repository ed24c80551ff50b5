#include "metrics/statistics/power.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/random.h"
#include "metrics/statistics/log_gammas.h"
#include "metrics/statistics/sequential_mcnemar.h"

namespace evalbus::metrics {
namespace {

using Binomial = boost::math::binomial_distribution<>;

constexpr int kMaxForExactFisher = 500;

// Range of success counts whose probability is not negligible, for `trials` trials at `rate`.
struct LikelyCounts {
  int first, last;
  LikelyCounts(int trials, double rate) {
    const double mean = trials * rate, spread = 8 * std::sqrt(trials * rate * (1 - rate)) + 8;
    first = std::max(0, static_cast<int>(mean - spread));
    last = std::min(trials, static_cast<int>(mean + spread));
  }
};

// For each number of successes of a, returns the largest number of successes of b at which Fisher's test
// shows that a is better; -1 if there is none. The results agree with FisherTest() in exact_tests.h, but all
// tables are computed at once.
std::vector<int> FisherLimits(int trials_a, int trials_b, double alpha) {
  const std::vector<double> log_factorial = LogGammas(1, trials_a + trials_b);
  const auto log_choose = [&](int n, int k) {
    return log_factorial[static_cast<size_t>(n)] - log_factorial[static_cast<size_t>(k)] -
           log_factorial[static_cast<size_t>(n - k)];
  };
  std::vector<int> limits(static_cast<size_t>(trials_a) + 1, -1);
  for (int successes = 0; successes <= trials_a + trials_b; ++successes) {
    const int first = std::max(0, successes - trials_b), last = std::min(successes, trials_a);
    std::vector<double> probability;
    for (int k = first; k <= last; ++k) {
      probability.push_back(std::exp(log_choose(trials_a, k) + log_choose(trials_b, successes - k) -
                                     log_choose(trials_a + trials_b, successes)));
    }
    std::vector<double> sorted = probability, sums(probability.size());
    std::sort(sorted.begin(), sorted.end());
    std::partial_sum(sorted.begin(), sorted.end(), sums.begin());
    for (int k = last; k >= first; --k) {
      const int in_b = successes - k;
      if (static_cast<double>(k) / trials_a <= static_cast<double>(in_b) / trials_b) break;
      const auto as_improbable = std::upper_bound(sorted.begin(), sorted.end(),
                                                  probability[static_cast<size_t>(k - first)] * (1 + 1e-7));
      if (sums[static_cast<size_t>(as_improbable - sorted.begin()) - 1] >= alpha) break;
      int& limit = limits[static_cast<size_t>(k)];
      limit = std::max(limit, in_b);
    }
  }
  return limits;
}

}  // namespace

DiscordantShares DiscordantShares::AroundOneHalf(double difference) {
  const double better = (1 + difference) / 2, worse = (1 - difference) / 2;
  return {better * better, worse * worse};
}

double McNemarPower(int pairs, const DiscordantShares& shares, double alpha) {
  const double discordant = std::min(1.0, shares.only_a + shares.only_b);
  if (pairs == 0 || discordant == 0) return 0;
  const Binomial counts(pairs, discordant);
  const LikelyCounts likely(pairs, discordant);
  double power = 0;
  // Largest number of pairs won by b only for which a is still shown to be better; never decreases with n.
  int against = -1;
  for (int n = likely.first; n <= likely.last; ++n) {
    const Binomial fair(n, 0.5);
    while (2 * (against + 1) < n && 2 * cdf(fair, against + 1) < alpha) ++against;
    if (against < 0) continue;
    power += pdf(counts, n) * cdf(Binomial(n, shares.only_b / (shares.only_a + shares.only_b)), against);
  }
  return power;
}

double SequentialPower(int step, int most, const DiscordantShares& shares, double alpha) {
  const int trials = std::clamp(8'000'000 / most, 500, 4000);
  int found = 0;
  for (int trial = 0; trial < trials; ++trial) {
    Random random(trial, 0);
    int only_a = 0, only_b = 0;
    for (int pair = 1; pair <= most; ++pair) {
      const double drawn = random.Uniform(0, 1);
      only_a += drawn < shares.only_a;
      only_b += drawn >= shares.only_a && drawn < shares.only_a + shares.only_b;
      if (pair % step != 0 && pair != most) continue;
      if (SequentialP({only_a, only_b}, std::nullopt, pair == most) > alpha) continue;
      found += only_a > only_b;
      break;
    }
  }
  return static_cast<double>(found) / trials;
}

double FisherPower(int trials_a, int trials_b, double rate_a, double rate_b, double alpha) {
  // Rounding may have moved the rates out of [0, 1].
  rate_a = std::clamp(rate_a, 0.0, 1.0);
  rate_b = std::clamp(rate_b, 0.0, 1.0);
  if (std::min(trials_a, trials_b) == 0) return 0;
  if (std::max(trials_a, trials_b) > kMaxForExactFisher) {
    const boost::math::normal_distribution<> normal;
    const double n_a = trials_a, n_b = trials_b, rate = (n_a * rate_a + n_b * rate_b) / (n_a + n_b);
    const double by_chance = std::sqrt(rate * (1 - rate) * (1 / n_a + 1 / n_b));
    const double spread = std::sqrt(rate_a * (1 - rate_a) / n_a + rate_b * (1 - rate_b) / n_b);
    const double needed = quantile(normal, 1 - alpha / 2) * by_chance;
    if (spread == 0) return rate_a - rate_b > needed ? 1 : 0;
    return cdf(normal, (rate_a - rate_b - needed) / spread);
  }
  const std::vector<int> limits = FisherLimits(trials_a, trials_b, alpha);
  const Binomial a(trials_a, rate_a), b(trials_b, rate_b);
  double power = 0;
  for (int k = 0; k <= trials_a; ++k) {
    if (const int limit = limits[static_cast<size_t>(k)]; limit >= 0) power += pdf(a, k) * cdf(b, limit);
  }
  return power;
}

std::optional<double> FindableDifference(const std::function<double(double)>& power, double largest) {
  constexpr double kStep = 1e-3;
  int below = 0, above = static_cast<int>(largest / kStep + 1e-9);
  if (power(above * kStep) < kWantedPower) return std::nullopt;
  while (above - below > 1) {
    const int middle = (below + above) / 2;
    (power(middle * kStep) < kWantedPower ? below : above) = middle;
  }
  return above * kStep;
}

std::optional<int> TrialsNeeded(const std::function<double(int)>& power) {
  int below = 0, above = 1;
  while (power(above) < kWantedPower) {
    if (above == kMaxTrials) return std::nullopt;
    below = above;
    above = std::min(2 * above, kMaxTrials);
  }
  while (above - below > 1) {
    const int middle = below + (above - below) / 2;
    (power(middle) < kWantedPower ? below : above) = middle;
  }
  return above;
}

}  // namespace evalbus::metrics
