// Adjustment of p values for testing several hypotheses at once. Source: Holm 1979, "A simple sequentially
// rejective multiple test procedure", Scandinavian Journal of Statistics 6.
#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

namespace evalbus::metrics {

// Adjusted values in the order given; each below 0.05 may be called significant, with at most 5 % chance of
// any error among all.
inline std::vector<double> HolmAdjusted(const std::vector<double>& p) {
  std::vector<size_t> order(p.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return p[a] < p[b]; });
  std::vector<double> adjusted(p.size());
  double largest = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    largest = std::max(largest, static_cast<double>(p.size() - i) * p[order[i]]);
    adjusted[order[i]] = std::min(1.0, largest);
  }
  return adjusted;
}

}  // namespace evalbus::metrics
