// Rates as text. Everything that shows a rate uses this function, so that it is rounded in the same way
// everywhere; viz/viewer/page/dom.js has the same rule for the page in the browser.
#pragma once

#include <cmath>
#include <string>

#include "base/text.h"

namespace evalbus {

// "83 %" of the share 0.825: rounded to whole percents, halves up. "-" if the share is NaN or infinite.
inline std::string Percent(double share) {
  if (!std::isfinite(share)) return "-";
  // A share of k / n is up to 1e-16 below the exact one; half percents must nevertheless be rounded up.
  return std::to_string(std::llround(std::floor(100 * share + 0.5 + 1e-9))) + " %";
}

// "-13" percentage points of the difference -0.125 of two shares: halves away from zero. "-" if the
// difference is NaN or infinite.
inline std::string PercentagePoints(double difference, int decimals = 0) {
  if (!std::isfinite(difference)) return "-";
  const double scale = std::pow(10, decimals);
  const double size = std::floor(100 * scale * std::abs(difference) + 0.5 + 1e-9) / scale;
  return Fixed(std::copysign(size, difference), decimals);
}

}  // namespace evalbus
