#include "metrics/statistics/noninferiority.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <vector>

namespace evalbus::metrics {
namespace {

// The probability is computed for kShares shares of discordant pairs. A search of kRefinements steps around
// the share with the largest probability then refines it.
constexpr int kShares = 200, kRefinements = 20;
// Steps of the bisection for a bound: to within 2^-14 of the range.
constexpr int kBoundSteps = 14;

// Returns P(Binomial(n, p) >= k).
double Tail(int n, double p, int k) {
  if (k <= 0) return 1;
  if (k > n || p <= 0) return 0;
  if (p >= 1) return 1;
  return cdf(complement(boost::math::binomial_distribution<>(n, p), k - 1));
}

// The set of outcomes whose score is at least `score`. It is stored as, for each number of pairs that only b
// won, the smallest sufficient number of pairs that only a won; pairs + 1 if no number suffices.
class HighScores {
 public:
  HighScores(int pairs, double difference, double score) : pairs_(pairs) {
    for (int i = 1; i <= pairs; ++i) {
      log_factorials_.push_back(log_factorials_.back() + std::log(static_cast<double>(i)));
    }
    for (int only_b = 0; only_b <= pairs; ++only_b) {
      // The smallest number never decreases with only_b.
      int only_a = fewest_.empty() ? 0 : fewest_.back();
      const int most = pairs - only_b;
      while (only_a <= most && PairedScore({pairs, only_a, only_b}, difference) < score) ++only_a;
      fewest_.push_back(only_a <= most ? only_a : pairs + 1);
      if (only_a > most) break;
    }
  }
  // Returns the probability of these outcomes if only a, and only b, succeeds in these shares of the pairs.
  double Probability(const DiscordantShares& shares) const {
    if (shares.only_b <= 0) return Tail(pairs_, shares.only_a, fewest_[0]);
    // Share of a among the pairs that b did not win.
    const double share_a = std::clamp(shares.only_a / (1 - shares.only_b), 0.0, 1.0);
    const double mean = pairs_ * shares.only_b, spread = 7 * std::sqrt(mean * (1 - shares.only_b)) + 7;
    const int last = std::min(static_cast<int>(fewest_.size()) - 1, static_cast<int>(mean + spread));
    int only_b = std::max(0, static_cast<int>(mean - spread));
    if (only_b > last) return 0;
    // P(Binomial(pairs - only_b, share_a) >= least), updated from one number to the next.
    int least = fewest_[static_cast<size_t>(only_b)];
    double tail = Tail(pairs_ - only_b, share_a, least), sum = 0;
    for (;;) {
      sum += Exactly(pairs_, shares.only_b, only_b) * std::max(0.0, tail);
      if (++only_b > last) return sum;
      tail -= share_a * Exactly(pairs_ - only_b, share_a, least - 1);
      for (; least < fewest_[static_cast<size_t>(only_b)]; ++least) {
        tail -= Exactly(pairs_ - only_b, share_a, least);
      }
    }
  }

 private:
  // Returns P(Binomial(n, p) = k).
  double Exactly(int n, double p, int k) const {
    if (k < 0 || k > n) return 0;
    if (p <= 0 || p >= 1) return k == (p <= 0 ? 0 : n) ? 1 : 0;
    const auto log_factorial = [this](int i) { return log_factorials_[static_cast<size_t>(i)]; };
    return std::exp(log_factorial(n) - log_factorial(k) - log_factorial(n - k) + k * std::log(p) +
                    (n - k) * std::log1p(-p));
  }

  int pairs_;
  std::vector<double> log_factorials_{0.0};
  std::vector<int> fewest_;
};

// Returns the largest probability of a high score if rate(a) - rate(b) = difference. The maximum is over all
// shares of discordant pairs that have this difference.
double LargestProbability(const HighScores& scores, double difference) {
  const double least = std::max(0.0, -difference), step = ((1 - difference) / 2 - least) / kShares;
  const auto at = [&](double only_b) { return scores.Probability({only_b + difference, only_b}); };
  double best = 0;
  int best_at = 0;
  for (int i = 0; i <= kShares; ++i) {
    const double probability = at(least + i * step);
    if (probability <= best) continue;
    best = probability;
    best_at = i;
  }
  double low = least + std::max(0, best_at - 1) * step, high = least + std::min(kShares, best_at + 1) * step;
  for (int i = 0; i < kRefinements; ++i) {
    const double left = low + (high - low) / 3, right = high - (high - low) / 3;
    const double at_left = at(left), at_right = at(right);
    best = std::max({best, at_left, at_right});
    (at_left < at_right ? low : high) = at_left < at_right ? left : right;
  }
  return std::min(1.0, best);
}

}  // namespace

double PairedScore(const Discordant& counts, double difference) {
  const double n = counts.pairs, a = counts.only_a, b = counts.only_b, d = difference;
  // The most probable share of b, given the difference, solves 2 n q^2 + linear q - b d (1 - d) = 0.
  const double linear = (2 * n - a + b) * d - a - b;
  const double root = std::sqrt(std::max(0.0, linear * linear + 8 * n * b * d * (1 - d)));
  const double share_b = (root - linear) / (4 * n);
  const double variance = n * (2 * share_b + d * (1 - d));
  const double excess = a - b - n * d;
  if (variance > 1e-12 * n) return excess / std::sqrt(variance);
  return std::abs(excess) <= 1e-9 * n ? 0 : std::copysign(1e9, excess);
}

double PairedAboveTest(const Discordant& counts, double difference) {
  if (counts.pairs == 0) return 1;
  const double score = PairedScore(counts, difference);
  if (counts.pairs > kMaxPairsForExact) {
    return cdf(complement(boost::math::normal_distribution<>(), score));
  }
  // The tolerance makes scores count as equal if they differ only by rounding.
  return LargestProbability(HighScores(counts.pairs, difference, score - 1e-9), difference);
}

PairedAbove TestPairedAbove(const Discordant& counts, double difference, double alpha) {
  if (counts.pairs == 0) return {};
  PairedAbove result{.is_above = PairedAboveTest(counts, difference) <= alpha, .lower = -1};
  double low = result.is_above ? difference : -1;
  double high = result.is_above ? std::max(difference, counts.difference()) : difference;
  for (int i = 0; i < kBoundSteps; ++i) {
    const double middle = (low + high) / 2;
    (PairedAboveTest(counts, middle) <= alpha ? low : high) = middle;
  }
  result.lower = low;
  return result;
}

std::optional<int> PairsNeeded(const DiscordantShares& shares, double difference, double alpha) {
  if (shares.only_a - shares.only_b <= difference) return std::nullopt;
  const double score = quantile(boost::math::normal_distribution<>(), 1 - alpha);
  const auto needed =
      TrialsNeeded([&](int pairs) { return HighScores(pairs, difference, score).Probability(shares); });
  if (!needed || difference >= 0) return needed;
  // `needed` uses the critical score of a normal distribution. If no pair is discordant, the exact p is at
  // least (1 + difference)^n, so fewer pairs could not reject.
  return std::max(*needed, static_cast<int>(std::ceil(std::log(alpha) / std::log1p(difference))));
}

}  // namespace evalbus::metrics
