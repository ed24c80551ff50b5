// Hybrid score intervals of the difference of two proportions, p_a - p_b. They are built from the Wilson
// intervals of both proportions.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "metrics/statistics/interval.h"
#include "metrics/statistics/wilson.h"

namespace evalbus::metrics {

// Interval for independent samples. Source: Newcombe 1998, "Interval estimation for the difference between
// independent proportions", Statistics in Medicine 17, method 10. [-1, 1] if a sample is empty.
inline Interval NewcombeInterval(double successes_a, double trials_a, double successes_b, double trials_b) {
  if (trials_a == 0 || trials_b == 0) return {-1, 1};
  const double a = successes_a / trials_a, b = successes_b / trials_b;
  const Interval wilson_a = WilsonInterval(successes_a, trials_a);
  const Interval wilson_b = WilsonInterval(successes_b, trials_b);
  return {a - b - std::hypot(a - wilson_a.lower, wilson_b.upper - b),
          a - b + std::hypot(wilson_a.upper - a, b - wilson_b.lower)};
}

// Number of pairs in which both, only one, or neither succeeded.
struct PairCounts {
  int both = 0;
  int only_a = 0;
  int only_b = 0;
  int neither = 0;

  int pairs() const { return both + only_a + only_b + neither; }
  int successes_a() const { return both + only_a; }
  int successes_b() const { return both + only_b; }
};

// Interval for paired samples. Source: Newcombe 1998, "Improved confidence intervals for the difference
// between binomial proportions based on paired data", Statistics in Medicine 17, method 10. It is the
// interval for independent samples, adjusted for the correlation phi of the fourfold table. A positive phi
// has a continuity correction and makes the interval narrower. [-1, 1] without pairs. samples: effective
// number of independent pairs; all pairs by default.
inline Interval NewcombePairedInterval(const PairCounts& counts, std::optional<int> samples = std::nullopt) {
  if (counts.pairs() == 0) return {-1, 1};
  const double n = samples.value_or(counts.pairs()), scale = n / counts.pairs();
  const double successes_a = counts.successes_a() * scale, successes_b = counts.successes_b() * scale;
  const double a = successes_a / n, b = successes_b / n;
  const Interval wilson_a = WilsonInterval(successes_a, n);
  const Interval wilson_b = WilsonInterval(successes_b, n);
  const double margins = successes_a * (n - successes_a) * successes_b * (n - successes_b);
  double phi = 0;
  if (margins > 0) {
    const double product = scale * scale *
                           (static_cast<double>(counts.both) * counts.neither -
                            static_cast<double>(counts.only_a) * counts.only_b);
    phi = (product > 0 ? std::max(product - n / 2, 0.0) : product) / std::sqrt(margins);
  }
  const auto distance = [phi](double x, double y) {
    return std::sqrt(std::max(0.0, x * x - 2 * phi * x * y + y * y));
  };
  return {a - b - distance(a - wilson_a.lower, wilson_b.upper - b),
          a - b + distance(wilson_a.upper - a, b - wilson_b.lower)};
}

}  // namespace evalbus::metrics
