// When two numbers are one. Equal differences, and sums of equal numbers in another order, differ in their
// last bits: 5.20 - 5.46 + 0.26 is not 0. n steps of arithmetic are off by at most n 2^-53 of the largest
// number in them (Higham 2002, "Accuracy and stability of numerical algorithms", 4.2), less than kTie up to n
// = 2^20; what differs in truth, a time by a tick, a count by one, a share by a stage, differs by more.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

namespace evalbus::metrics {

// Of the largest magnitude at hand.
inline constexpr double kTie = 0x1p-32;  // 2.3e-10

// 0 for none.
inline double LargestMagnitude(std::span<const double> x) {
  return std::accumulate(x.begin(), x.end(), 0.0,
                         [](double largest, double value) { return std::max(largest, std::abs(value)); });
}

// The values, with magnitudes no further apart than kTie of `largest` made the same one, and those near 0
// made 0.
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

// a - b of pairs (equal sizes).
inline std::vector<double> PairedDifferences(std::span<const double> a, std::span<const double> b) {
  std::vector<double> differences;
  for (size_t i = 0; i < a.size(); ++i) differences.push_back(a[i] - b[i]);
  return WithTies(differences, std::max(LargestMagnitude(a), LargestMagnitude(b)));
}

}  // namespace evalbus::metrics
