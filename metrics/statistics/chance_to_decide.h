// Estimates whether it is worth continuing a sequential comparison (sequential_mcnemar.h) that is not decided
// yet.
#pragma once

#include <functional>
#include <optional>

#include "metrics/statistics/sequential_mcnemar.h"

namespace evalbus::metrics {

// A comparison ends early, without a decision, if the chance of a later decision is below this value. Ending
// early cannot raise the rate of wrong decisions. At most this share of the comparisons that end early would
// have been decided.
inline constexpr double kLeastChance = 0.01;

// Returns the probability that decides(wins) is true after `most` pairs, given the wins in the first `pairs`
// of them. The outcomes of the remaining pairs have a Dirichlet-multinomial predictive distribution, with
// Jeffreys' prior for the three shares of pairs: won by a, won by b, and won by neither. decides() must be
// symmetric in the two sides, and must remain true if the winner's share of the wins grows.
double ChanceToDecide(const Wins& wins, int pairs, int most,
                      const std::function<bool(const Wins& wins)>& decides);

// Returns an upper bound of the chance that the sequential test at the error rate alpha decides by its last
// look, after `most` pairs. It is the chance of a decision by success, plus the chance of a decision by
// progress if progress is tested.
double ChanceOfSequentialTest(const Wins& success, const std::optional<Wins>& progress, int pairs, int most,
                              double alpha);

}  // namespace evalbus::metrics
