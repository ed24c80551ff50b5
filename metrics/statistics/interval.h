// Definitions shared by the procedures of this folder, and intervals of proportions and of their differences.
// All intervals are two-sided 95 % intervals.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

namespace evalbus::metrics {

struct Interval {
  double lower;
  double upper;

  // Also returns false if the bounds are NaN, which means that there is no interval.
  bool excludes_0() const { return lower > 0 || upper < 0; }
};

// Standard normal quantile at 97.5 %.
inline constexpr double kNormal975 = 1.959963984540054;
// Two-sided significance level.
inline constexpr double kAlpha = 0.05;

// Returns the approximate standard error of an estimate with this interval; NaN if there is no interval.
inline double StandardErrorOf(const Interval& interval) {
  return (interval.upper - interval.lower) / (2 * kNormal975);
}

// Score interval of a proportion. Source: Wilson 1927, "Probable inference, the law of succession, and
// statistical inference", JASA 22.
//
// Returns (p + z^2/2n +- z sqrt(p (1 - p)/n + z^2/4n^2)) / (1 + z^2/n) with p = successes / n, n = trials and
// z = kNormal975. [0, 1] without trials.
inline Interval WilsonInterval(double successes, double trials) {
  if (trials == 0) return {0, 1};
  const double z = kNormal975, n = trials, p = successes / n;
  const double center = p + z * z / (2 * n);
  const double half_width = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  const double scale = 1 + z * z / n;
  // Without successes or without failures, one bound is exactly 0 or 1, but rounding would change it.
  return {successes == 0 ? 0 : std::max(0.0, (center - half_width) / scale),
          successes >= trials ? 1 : std::min(1.0, (center + half_width) / scale)};
}

// Returns the interval of the difference of two proportions, p_a - p_b, built from their Wilson intervals,
// for independent samples. Source: Newcombe 1998, "Interval estimation for the difference between independent
// proportions", Statistics in Medicine 17, method 10. [-1, 1] if a sample is empty.
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

// The same for paired samples. Source: Newcombe 1998, "Improved confidence intervals for the difference
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
