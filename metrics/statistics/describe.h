// Descriptive statistics of a sample.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <span>

#include "metrics/sample/quantile.h"

namespace evalbus::metrics {

// Returns the mean; NaN for an empty sample.
inline double Mean(std::span<const double> x) {
  return std::reduce(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

// Returns the sample standard deviation (n - 1); NaN for fewer than two values.
inline double StandardDeviation(std::span<const double> x) {
  if (x.size() < 2) return std::numeric_limits<double>::quiet_NaN();
  const double mean = Mean(x);
  const double squares = std::transform_reduce(
      x.begin(), x.end(), 0.0, std::plus(), [mean](double value) { return (value - mean) * (value - mean); });
  return std::sqrt(squares / static_cast<double>(x.size() - 1));
}

}  // namespace evalbus::metrics
