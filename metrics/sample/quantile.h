// Quantiles of sorted values.
#pragma once

#include <cstddef>
#include <limits>
#include <span>

namespace evalbus::metrics {

// Returns quantile p of values in ascending order, by linear interpolation between the values around index
// (n - 1) p. This is definition 7 of Hyndman and Fan 1996, "Sample quantiles in statistical packages", the
// default of R and NumPy. p = 0.5 gives the median. NaN for an empty sample.
inline double Quantile(std::span<const double> sorted, double p) {
  if (sorted.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double at = static_cast<double>(sorted.size() - 1) * p;
  const auto below = static_cast<size_t>(at);
  if (below + 1 == sorted.size()) return sorted[below];
  const double fraction = at - static_cast<double>(below);
  return sorted[below] + fraction * (sorted[below + 1] - sorted[below]);
}

}  // namespace evalbus::metrics
