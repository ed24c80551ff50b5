#include "metrics/statistics/chance_to_decide.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "metrics/statistics/log_gammas.h"

namespace evalbus::metrics {
namespace {

// Returns the fewest wins of one side that decide if both sides together have `total` wins; total + 1 if no
// number decides.
int FewestWins(int total, const std::function<bool(const Wins&)>& decides) {
  int no = (total + 1) / 2 - 1, yes = total + 1;
  while (yes - no > 1) {
    const int wins = no + (yes - no) / 2;
    (decides({wins, total - wins}) ? yes : no) = wins;
  }
  return yes;
}

}  // namespace

double ChanceToDecide(const Wins& wins, int pairs, int most,
                      const std::function<bool(const Wins&)>& decides) {
  const int left = most - pairs;
  const auto at = [](const std::vector<double>& values, int i) { return values[static_cast<size_t>(i)]; };
  const std::vector<double> of_a = LogGammas(wins.a + 0.5, left), of_b = LogGammas(wins.b + 0.5, left),
                            of_others = LogGammas(pairs - wins.a - wins.b + 0.5, left),
                            factorial = LogGammas(1, left);
  const double constant = at(factorial, left) + std::lgamma(pairs + 1.5) - std::lgamma(most + 1.5) - of_a[0] -
                          of_b[0] - of_others[0];
  double chance = 0;
  for (int more = 0; more <= left; ++more) {
    const int fewest = FewestWins(wins.a + wins.b + more, decides);
    for (int a = 0; a <= more; ++a) {
      const int b = more - a;
      if (std::max(wins.a + a, wins.b + b) < fewest) continue;
      chance += std::exp(constant + at(of_a, a) + at(of_b, b) + at(of_others, left - more) -
                         at(factorial, a) - at(factorial, b) - at(factorial, left - more));
    }
  }
  return chance;
}

double ChanceOfSequentialTest(const Wins& success, const std::optional<Wins>& progress, int pairs, int most,
                              double alpha) {
  double chance = ChanceToDecide(
      success, pairs, most, [&](const Wins& wins) { return SequentialP(wins, std::nullopt, true) <= alpha; });
  if (progress) {
    chance += ChanceToDecide(*progress, pairs, most,
                             [&](const Wins& wins) { return SequentialP({}, wins, false) <= alpha; });
  }
  return std::min(1.0, chance);
}

}  // namespace evalbus::metrics
