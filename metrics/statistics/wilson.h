// Score interval of a proportion. Source: Wilson 1927, "Probable inference, the law of succession, and
// statistical inference", JASA 22.
#pragma once

#include <algorithm>
#include <cmath>

#include "metrics/statistics/interval.h"

namespace evalbus::metrics {

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

}  // namespace evalbus::metrics
