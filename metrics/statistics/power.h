// Which differences of success rates a comparison can find: probability that the very test that will be used
// finds a true difference. Exact: summed over all outcomes (of the sequential test, whose outcomes are too
// many: simulated, always with the same random numbers).
#pragma once

#include <functional>
#include <optional>

#include "metrics/statistics/interval.h"

namespace evalbus::metrics {

// A difference counts as findable when the test finds it with this probability: four times in five.
inline constexpr double kWantedPower = 0.8;

// Shares of pairs in which only a, and only b, succeeds.
struct DiscordantShares {
  double only_a = 0, only_b = 0;

  // For unrelated outcomes at rates (1 + difference) / 2 and (1 - difference) / 2: around one half, where
  // most pairs are needed.
  static DiscordantShares AroundOneHalf(double difference);
};

// Probability that the exact McNemar test finds a better than b, at p < alpha.
double McNemarPower(int pairs, const DiscordantShares& shares, double alpha = kAlpha);

// The same of the sequential test (sequential_mcnemar.h) that is looked at after every `step` pairs, up to
// `most`.
double SequentialPower(int step, int most, const DiscordantShares& shares, double alpha = kAlpha);

// Probability that Fisher's exact test finds sample a better than b; above 500 trials by the normal
// approximation.
double FisherPower(int trials_a, int trials_b, double rate_a, double rate_b, double alpha = kAlpha);

// Smallest difference, to a tenth of a point, whose power is kWantedPower; nothing if that of `largest` is
// less.
std::optional<double> FindableDifference(const std::function<double(double difference)>& power,
                                         double largest = 1);

// Approximately the smallest number of trials with kWantedPower (power rises in steps); nothing if
// kMaxTrials are too few.
inline constexpr int kMaxTrials = 100'000;
std::optional<int> TrialsNeeded(const std::function<double(int trials)>& power);

}  // namespace evalbus::metrics
