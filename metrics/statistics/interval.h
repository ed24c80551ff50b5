// Definitions shared by the procedures of this folder. All intervals are two-sided 95 % intervals.
#pragma once

namespace evalbus::metrics {

struct Interval {
  double lower;
  double upper;

  // False if there is no interval, whose bounds are NaN.
  bool excludes_0() const { return lower > 0 || upper < 0; }
};

// Standard normal quantile at 97.5 %.
inline constexpr double kNormal975 = 1.959963984540054;
// Two-sided significance level.
inline constexpr double kAlpha = 0.05;

// Approximate standard error of an estimate with this interval; NaN if there is no interval.
inline double StandardErrorOf(const Interval& interval) {
  return (interval.upper - interval.lower) / (2 * kNormal975);
}

}  // namespace evalbus::metrics
