// Equality of floating-point numbers up to rounding. Results that are equal in exact arithmetic may differ in
// their last bits: 5.20 - 5.46 + 0.26 is not 0. The error of n arithmetic steps is at most n 2^-53 of the
// largest operand (Higham 2002, "Accuracy and stability of numerical algorithms", 4.2), which is less than
// kTie up to n = 2^20. Real differences are larger: times differ by at least a tick, counts by at least one,
// and progress by at least a stage.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

namespace evalbus::metrics {

// Tolerance for equality, relative to the largest magnitude in the data.
inline constexpr double kTie = 0x1p-32;  // 2.3e-10

// Returns 0 for an empty span.
inline double LargestMagnitude(std::span<const double> x) {
  return std::accumulate(x.begin(), x.end(), 0.0,
                         [](double largest, double value) { return std::max(largest, std::abs(value)); });
}

// Removes differences due to rounding: sorted by magnitude, values that differ from their predecessor by at
// most kTie * largest get its magnitude, and values that are this close to 0 become 0.
inline std::vector<double> WithTies(std::span<const double> x, double largest) {
  std::vector<double> values(x.begin(), x.end());
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return std::abs(x[a]) < std::abs(x[b]); });
  double before = 0, one = 0;
  for (const size_t i : order) {
    const double size = std::abs(x[i]);
    if (size - before > kTie * largest) one = size;
    before = size;
    values[i] = std::copysign(one, x[i]);
  }
  return values;
}
inline std::vector<double> WithTies(std::span<const double> x) { return WithTies(x, LargestMagnitude(x)); }

// Returns a - b for pairs (equal sizes), with ties as in WithTies().
inline std::vector<double> PairedDifferences(std::span<const double> a, std::span<const double> b) {
  std::vector<double> differences;
  for (size_t i = 0; i < a.size(); ++i) differences.push_back(a[i] - b[i]);
  return WithTies(differences, std::max(LargestMagnitude(a), LargestMagnitude(b)));
}

}  // namespace evalbus::metrics
