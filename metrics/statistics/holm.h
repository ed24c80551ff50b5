// Adjusts p-values for testing several hypotheses. Source: Holm 1979, "A simple sequentially rejective
// multiple test procedure", Scandinavian Journal of Statistics 6.
#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

namespace evalbus::metrics {

// Returns adjusted p-values in the order of `p`. If every value below 0.05 is called significant, the
// probability of any false positive among them is at most 5 %.
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
