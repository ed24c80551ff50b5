// Computes ticks of axes and bins of histograms, and formats numbers for figures.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace evalbus::report {

// Returns whether low and high differ by more than rounding. If not, all values count as equal and no axis
// can be drawn.
bool IsRange(double low, double high);

struct Ticks {
  // Positions of the ticks: multiples of `step`, ascending.
  std::vector<double> at;
  // Distance between ticks: 1, 2 or 5 times a power of ten.
  double step;
};

// Returns the multiples within [lower, upper] of the smallest step that gives at most `most` (>= 2) of them.
// Both ends must be finite and IsRange(lower, upper) must be true.
Ticks TicksWithin(double lower, double upper, int most);
// Returns ticks as TicksWithin() does, with one more multiple at an end where this is necessary to enclose
// the range. Used for bin edges and for axes that end at a tick.
Ticks TicksAround(double lower, double upper, int most);

// Returns bin edges for a histogram: round numbers that enclose the values. If the values are integers of a
// small range, the bins are centered on integers (-0.5, 0.5, 1.5 ...). The values must be finite and
// IsRange(minimum, maximum) must be true.
std::vector<double> BinEdges(std::span<const double> values);
// Returns the number of values in each bin. Bin k counts the values with edges[k] <= value < edges[k + 1];
// the last bin includes its upper edge.
std::vector<int> CountInBins(std::span<const double> values, std::span<const double> edges);

// Formats with `digits` significant digits, without trailing zeros ("0.1418", "5.7"). Below 1e7, the integer
// part is always complete ("12346"). Returns "-" if the value is not finite.
std::string Number(double value, int digits = 4);

}  // namespace evalbus::report
