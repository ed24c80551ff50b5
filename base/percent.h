// Rates as text. Texts and pages format whole percents with Percent(), so that a rate is rounded in the same
// way everywhere; viz/viewer/page/dom.js has the same rule for the page in the browser.
#pragma once

#include <cmath>
#include <string>

#include "base/text.h"

namespace evalbus {

// Returns a share as text, rounded to whole percents, halves up: "83 %" for 0.825. "-" if it is NaN or
// infinite.
inline std::string Percent(double share) {
  if (!std::isfinite(share)) return "-";
  // The double nearest to k / n may be up to 1e-16 too small. Half percents must nevertheless be rounded up.
  return std::to_string(std::llround(std::floor(100 * share + 0.5 + 1e-9))) + " %";
}

// Returns the difference of two shares in percentage points, halves rounded away from zero: "-13" for -0.125.
// "-" if the difference is NaN or infinite.
inline std::string PercentagePoints(double difference, int decimals = 0) {
  if (!std::isfinite(difference)) return "-";
  const double scale = std::pow(10, decimals);
  const double size = std::floor(100 * scale * std::abs(difference) + 0.5 + 1e-9) / scale;
  return Fixed(std::copysign(size, difference), decimals);
}

// Number of decimals for the difference of two shares in percentage points: 1 if whole points would
// contradict the whole percents of the shares. For example, 62.5 points are not rounded beside 100 % and 38 %
// (37.5).
inline int PointDecimals(double share, double other) {
  const auto whole = [](double part) { return std::stoi(Percent(part)); };
  if (!std::isfinite(share) || !std::isfinite(other)) return 0;
  return std::stoi(PercentagePoints(share - other)) == whole(share) - whole(other) ? 0 : 1;
}

}  // namespace evalbus
