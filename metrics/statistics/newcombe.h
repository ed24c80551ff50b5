// Hybrid score intervals of the difference of two proportions, p_a - p_b, built from the Wilson interval of
// each.
#pragma once

#include <algorithm>
#include <cmath>

#include "metrics/statistics/interval.h"
#include "metrics/statistics/wilson.h"

namespace evalbus::metrics {

// Independent samples. Source: Newcombe 1998, "Interval estimation for the difference between independent
// proportions", Statistics in Medicine 17, method 10. [-1, 1] where a sample is empty.
inline Interval NewcombeInterval(int successes_a, int trials_a, int successes_b, int trials_b) {
  if (trials_a == 0 || trials_b == 0) return {-1, 1};
  const double a = static_cast<double>(successes_a) / trials_a,
               b = static_cast<double>(successes_b) / trials_b;
  const Interval wilson_a = WilsonInterval(successes_a, trials_a);
  const Interval wilson_b = WilsonInterval(successes_b, trials_b);
  return {a - b - std::hypot(a - wilson_a.lower, wilson_b.upper - b),
          a - b + std::hypot(wilson_a.upper - a, b - wilson_b.lower)};
}

// How often a pair succeeded in both, in one only, in neither.
struct PairCounts {
  int both = 0;
  int only_a = 0;
  int only_b = 0;
  int neither = 0;

  int pairs() const { return both + only_a + only_b + neither; }
  int successes_a() const { return both + only_a; }
  int successes_b() const { return both + only_b; }
};

// Pairs. Source: Newcombe 1998, "Improved confidence intervals for the difference between binomial
// proportions based on paired data", Statistics in Medicine 17, method 10: as above, less for what the two
// have in common, by the correlation phi of the fourfold table (with a continuity correction where it is
// positive). [-1, 1] without pairs.
inline Interval NewcombePairedInterval(const PairCounts& counts) {
  const double n = counts.pairs();
  if (n == 0) return {-1, 1};
  const double a = counts.successes_a() / n, b = counts.successes_b() / n;
  const Interval wilson_a = WilsonInterval(counts.successes_a(), counts.pairs());
  const Interval wilson_b = WilsonInterval(counts.successes_b(), counts.pairs());
  const double margins =
      counts.successes_a() * (n - counts.successes_a()) * counts.successes_b() * (n - counts.successes_b());
  double phi = 0;
  if (margins > 0) {
    const double product = static_cast<double>(counts.both) * counts.neither -
                           static_cast<double>(counts.only_a) * counts.only_b;
    phi = (product > 0 ? std::max(product - n / 2, 0.0) : product) / std::sqrt(margins);
  }
  const auto distance = [phi](double x, double y) {
    return std::sqrt(std::max(0.0, x * x - 2 * phi * x * y + y * y));
  };
  return {a - b - distance(a - wilson_a.lower, wilson_b.upper - b),
          a - b + distance(wilson_a.upper - a, b - wilson_b.lower)};
}

}  // namespace evalbus::metrics
