// Numbers for figures: where an axis has its marks, which bins a histogram has, how a value is written.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace evalbus::viz {

// Whether numbers from low to high differ by more than rounding; if not, they are one value, and there is no
// axis.
bool IsRange(double low, double high);

struct Ticks {
  // Multiples of `step`, ascending.
  std::vector<double> at;
  // 1, 2 or 5 times a power of ten.
  double step;
};

// The multiples within [lower, upper] of the smallest step that gives at most `most` (>= 2) of them. Takes
// a range (IsRange), both ends finite.
Ticks TicksWithin(double lower, double upper, int most);
// The same, with one more multiple at each end where that is needed to enclose the range: edges of bins, or
// an axis that ends on a mark.
Ticks TicksAround(double lower, double upper, int most);

// Edges of the bins of a histogram of finite values that make a range: round numbers that enclose them;
// around the integers (-0.5, 0.5, 1.5 ...) where the values are integers of a small range.
std::vector<double> BinEdges(std::span<const double> values);
// Bin k holds the values with edges[k] <= value < edges[k + 1], the last one also its upper edge.
std::vector<int> CountInBins(std::span<const double> values, std::span<const double> edges);

// Significant digits without trailing zeros ("0.1418", "5.7"); below 1e7 at least all of the integer part
// ("12346"); "-" for what is not finite.
std::string Number(double value, int digits = 4);

}  // namespace evalbus::viz
