// Descriptive statistics of a sample.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <span>

namespace evalbus::metrics {

// NaN for an empty sample.
inline double Mean(std::span<const double> x) {
  return std::reduce(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

// Sample standard deviation (n - 1); NaN for fewer than two values.
inline double StandardDeviation(std::span<const double> x) {
  if (x.size() < 2) return std::numeric_limits<double>::quiet_NaN();
  const double mean = Mean(x);
  const double squares = std::transform_reduce(
      x.begin(), x.end(), 0.0, std::plus(), [mean](double value) { return (value - mean) * (value - mean); });
  return std::sqrt(squares / static_cast<double>(x.size() - 1));
}

// Quantile of values in ascending order, by linear interpolation between the order statistics around (n - 1)
// p: definition 7 of Hyndman and Fan 1996, "Sample quantiles in statistical packages", the default of R and
// NumPy. p = 0.5 gives the median. NaN for an empty sample.
inline double Quantile(std::span<const double> sorted, double p) {
  if (sorted.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double at = static_cast<double>(sorted.size() - 1) * p;
  const auto below = static_cast<size_t>(at);
  if (below + 1 == sorted.size()) return sorted[below];
  const double fraction = at - static_cast<double>(below);
  return sorted[below] + fraction * (sorted[below + 1] - sorted[below]);
}

}  // namespace evalbus::metrics
