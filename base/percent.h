// Rates as text. Everything that shows a rate uses this function, so that it is rounded in the same way
// everywhere; viz/viewer/page/dom.js has the same rule for the page in the browser.
#pragma once

#include <cmath>
#include <string>

namespace evalbus {

// "83 %" of the share 0.825: rounded to whole percents, halves up. "-" if the share is NaN or infinite.
inline std::string Percent(double share) {
  if (!std::isfinite(share)) return "-";
  // A share of k / n is up to 1e-16 below the exact one; half percents must nevertheless be rounded up.
  return std::to_string(std::llround(std::floor(100 * share + 0.5 + 1e-9))) + " %";
}

}  // namespace evalbus
