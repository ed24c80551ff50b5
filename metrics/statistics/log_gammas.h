// Tables of the logarithm of the gamma function.
#pragma once

#include <cmath>
#include <vector>

namespace evalbus::metrics {

// Returns log(Gamma(first + i)) for i = 0 .. most. With first = 1, these are the logarithms of the factorials
// of i.
inline std::vector<double> LogGammas(double first, int most) {
  std::vector<double> logs = {std::lgamma(first)};
  for (int i = 0; i < most; ++i) logs.push_back(logs.back() + std::log(first + i));
  return logs;
}

}  // namespace evalbus::metrics
