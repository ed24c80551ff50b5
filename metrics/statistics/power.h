// Power of comparisons of success rates: the probability that the test that will be used detects a true
// difference. It is exact, summed over all outcomes. Only the sequential test has too many outcomes and is
// simulated, always with the same random numbers.
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

  // Shares for independent outcomes at rates (1 + difference) / 2 and (1 - difference) / 2: rates around one
  // half need the most pairs.
  static DiscordantShares AroundOneHalf(double difference);
};

// Probability that the exact McNemar test shows a to be better than b, at p < alpha.
double McNemarPower(int pairs, const DiscordantShares& shares, double alpha = kAlpha);

// Same for the sequential test (sequential_mcnemar.h), evaluated after every `step` pairs, up to `most`
// pairs.
double SequentialPower(int step, int most, const DiscordantShares& shares, double alpha = kAlpha);

// Probability that Fisher's exact test shows sample a to be better than b; above 500 trials by normal
// approximation.
double FisherPower(int trials_a, int trials_b, double rate_a, double rate_b, double alpha = kAlpha);

// Smallest difference, to 0.1 percentage points, with power kWantedPower; nothing if not even `largest` has
// it.
std::optional<double> FindableDifference(const std::function<double(double difference)>& power,
                                         double largest = 1);

// Approximately the smallest number of trials with power kWantedPower (power rises in steps); nothing if
// kMaxTrials are too few.
inline constexpr int kMaxTrials = 100'000;
std::optional<int> TrialsNeeded(const std::function<double(int trials)>& power);

}  // namespace evalbus::metrics
