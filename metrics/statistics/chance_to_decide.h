// Whether it is worth to continue a sequential comparison (sequential_mcnemar.h) that is not decided yet.
#pragma once

#include <functional>
#include <optional>

#include "metrics/statistics/sequential_mcnemar.h"

namespace evalbus::metrics {

// Below this chance of a decision, a comparison ends early. It then ends without a decision, which cannot
// raise the rate of wrong decisions; the price is at most this share of the comparisons that would have been
// decided at the maximum.
inline constexpr double kLeastChance = 0.01;

// Probability that decides(wins) is true after `most` pairs, given the wins in the first `pairs` of them: the
// predictive distribution of the other pairs, a Dirichlet-multinomial distribution with Jeffreys' prior for
// the shares of pairs that a wins, that b wins, and of the others. decides() must not depend on which side
// won, and become true with a larger share of the wins.
double ChanceToDecide(const Wins& wins, int pairs, int most,
                      const std::function<bool(const Wins& wins)>& decides);

// The chance that the sequential test decides by its last look, after `most` pairs, at the error rate alpha:
// by success, or, if progress is tested, by progress; at most the sum of both.
double ChanceOfSequentialTest(const Wins& success, const std::optional<Wins>& progress, int pairs, int most,
                              double alpha);

}  // namespace evalbus::metrics
