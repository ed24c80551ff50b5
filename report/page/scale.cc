#include "report/page/scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace evalbus::report {
namespace {

constexpr int kMaxBins = 14;

// Returns k * mantissa * 10^exponent. Negative exponents are computed by division, so that 0.3 is exactly 3 /
// 10.
double Multiple(double k, int mantissa, int exponent) {
  const double scale = std::pow(10.0, std::abs(exponent));
  return exponent < 0 ? k * mantissa / scale : k * mantissa * scale;
}

Ticks Find(double lower, double upper, int most, bool around) {
  // The search begins one power of ten too low.
  for (int exponent = static_cast<int>(std::floor(std::log10((upper - lower) / most))) - 1;; ++exponent) {
    for (const int mantissa : {1, 2, 5}) {
      const double step = Multiple(1, mantissa, exponent);
      // Tolerance for rounding errors in the quotients.
      constexpr double kSlack = 1e-9;
      const double first = around ? std::floor(lower / step + kSlack) : std::ceil(lower / step - kSlack);
      const double last = around ? std::ceil(upper / step - kSlack) : std::floor(upper / step + kSlack);
      if (last - first + 1 > most) continue;
      Ticks ticks{.at = {}, .step = step};
      for (double k = first; k <= last; ++k) ticks.at.push_back(Multiple(k, mantissa, exponent));
      return ticks;
    }
  }
}

}  // namespace

// Multiples are counted in doubles. In a smaller range, the counts would no longer be exact integers.
bool IsRange(double low, double high) { return high - low > 1e-9 * std::max(std::abs(low), std::abs(high)); }

Ticks TicksWithin(double lower, double upper, int most) { return Find(lower, upper, most, false); }
Ticks TicksAround(double lower, double upper, int most) { return Find(lower, upper, most, true); }

std::vector<double> BinEdges(std::span<const double> values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const bool integers =
      std::all_of(values.begin(), values.end(), [](double v) { return v == std::floor(v); });
  if (integers && *high - *low < kMaxBins) {
    std::vector<double> edges;
    for (double edge = *low - 0.5; edge < *high + 1; ++edge) edges.push_back(edge);
    return edges;
  }
  return TicksAround(*low, *high, kMaxBins + 1).at;
}

std::vector<int> CountInBins(std::span<const double> values, std::span<const double> edges) {
  std::vector<int> counts(edges.size() - 1);
  for (const double value : values) {
    const auto bin = std::upper_bound(edges.begin(), edges.end(), value) - edges.begin() - 1;
    ++counts[static_cast<size_t>(std::clamp<std::ptrdiff_t>(bin, 0, std::ssize(counts) - 1))];
  }
  return counts;
}

std::string Number(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  const double magnitude = std::abs(value);
  if (magnitude >= std::pow(10.0, digits - 1) && magnitude < 1e7) return fmt::format("{:.0f}", value);
  return fmt::format("{:.{}g}", value, digits);
}

}  // namespace evalbus::report
