// Whether it is worth continuing a sequential comparison (sequential_mcnemar.h) that is not decided yet.
#pragma once

#include <functional>
#include <optional>

#include "metrics/statistics/sequential_mcnemar.h"

namespace evalbus::metrics {

// A comparison ends early, without a decision, if the chance of a later decision is below this. This cannot
// raise the rate of wrong decisions. At most this share of the comparisons that end early would have been
// decided.
inline constexpr double kLeastChance = 0.01;

// Probability that decides(wins) is true after `most` pairs, given the wins in the first `pairs` of them. The
// outcomes of the other pairs have a Dirichlet-multinomial predictive distribution, with Jeffreys' prior for
// the shares of pairs that a wins, that b wins, and that neither wins. decides() must be symmetric in the two
// sides, and must remain true if the winner's share of the wins grows.
double ChanceToDecide(const Wins& wins, int pairs, int most,
                      const std::function<bool(const Wins& wins)>& decides);

// Upper bound of the chance that the sequential test decides by its last look, after `most` pairs, at the
// error rate alpha: the chance of a decision by success plus, if progress is tested, the chance of one by
// progress.
double ChanceOfSequentialTest(const Wins& success, const std::optional<Wins>& progress, int pairs, int most,
                              double alpha);

}  // namespace evalbus::metrics
