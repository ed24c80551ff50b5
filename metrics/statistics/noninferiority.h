// Tests whether one success rate is lower than another by a margin, on paired data. The tests meet the needs
// of a gate: they are valid for few pairs, and they bound the difference.
//
// Statistic: the score of Tango 1998, "Equivalence test and confidence interval for the difference in
// proportions for the paired-sample design", Statistics in Medicine 17. With its normal approximation, up to
// 6.5 % of tests with 20 to 100 pairs err instead of 5 %. Therefore, p is exact. It is the probability of a
// score that is at least as high, maximized over all shares of discordant pairs that have the tested
// difference.
// Source: Hsueh, Liu and Chen 2001, "Unconditional exact tests for equivalence or noninferiority for paired
// binary endpoints", Biometrics 57. Newcombe's interval (interval.h) is a two-sided approximation and is not
// used here.
#pragma once

#include <optional>

#include "metrics/statistics/power.h"

namespace evalbus::metrics {

// Pairs of which only a, or only b, succeeded, among all pairs.
struct Discordant {
  int pairs = 0;
  int only_a = 0, only_b = 0;

  double difference() const { return pairs == 0 ? 0 : static_cast<double>(only_a - only_b) / pairs; }
  Discordant swapped() const { return {pairs, only_b, only_a}; }
};

// Returns Tango's score of the hypothesis rate(a) - rate(b) = difference. It is approximately standard normal
// if the hypothesis is true, and high if the rate of a is higher. `difference` is in (-1, 1).
double PairedScore(const Discordant& counts, double difference);

// Above this number of pairs, the normal approximation is used for p, because its error is then small.
inline constexpr int kMaxPairsForExact = 2000;

// Returns the one-sided p of the hypothesis rate(a) - rate(b) <= difference; 1 if there are no pairs.
double PairedAboveTest(const Discordant& counts, double difference);

struct PairedAbove {
  // True if the hypothesis rate(a) - rate(b) <= difference is rejected at alpha.
  bool is_above = false;
  // Lower bound of rate(a) - rate(b) with confidence 1 - alpha; below the tested difference if and only if
  // not is_above. -1 without pairs.
  double lower = -1;
};
PairedAbove TestPairedAbove(const Discordant& counts, double difference, double alpha);

// Returns approximately the smallest number of pairs for which TestPairedAbove() rejects with power
// kWantedPower if the discordant pairs have these shares. Returns nullopt if rate(a) - rate(b) of the shares
// does not exceed `difference`, or if kMaxTrials pairs are too few.
std::optional<int> PairsNeeded(const DiscordantShares& shares, double difference, double alpha);

}  // namespace evalbus::metrics
