// Power of comparisons of success rates: the probability that the test detects a true difference. It is
// summed over all outcomes that are not negligible. For many trials of Fisher's test, it is approximated. The
// sequential test, which has too many outcomes, is simulated, always with the same random numbers.
#pragma once

#include <functional>
#include <optional>

#include "metrics/statistics/interval.h"

namespace evalbus::metrics {

// A difference counts as detectable if the test detects it with this probability.
inline constexpr double kWantedPower = 0.8;

// Shares of pairs in which only a, or only b, succeeds.
struct DiscordantShares {
  double only_a = 0, only_b = 0;

  // Shares for independent outcomes at rates (1 + difference) / 2 and (1 - difference) / 2. Rates around one
  // half are the worst case, because they need the most pairs.
  static DiscordantShares AroundOneHalf(double difference);
};

// Returns the probability that the exact McNemar test shows a to be better than b, at p < alpha.
double McNemarPower(int pairs, const DiscordantShares& shares, double alpha = kAlpha);

// Returns the probability that the sequential test (sequential_mcnemar.h) shows a to be better than b if it
// is evaluated after every `step` pairs, up to `most` pairs.
double SequentialPower(int step, int most, const DiscordantShares& shares, double alpha = kAlpha);

// Returns the probability that Fisher's exact test shows sample a to be better than b. If a sample has more
// than 500 trials, a normal approximation is used.
double FisherPower(int trials_a, int trials_b, double rate_a, double rate_b, double alpha = kAlpha);

// Returns the smallest difference, to 0.1 percentage points, that is detected with power kWantedPower.
// Returns nullopt if the power is lower even for the difference `largest`.
std::optional<double> FindableDifference(const std::function<double(double difference)>& power,
                                         double largest = 1);

// Approximately the smallest number of trials with power kWantedPower; the result is approximate because
// power does not rise smoothly. Returns nullopt if kMaxTrials trials are too few.
inline constexpr int kMaxTrials = 100'000;
std::optional<int> TrialsNeeded(const std::function<double(int trials)>& power);

}  // namespace evalbus::metrics
