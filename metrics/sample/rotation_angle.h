// Angle between two orientations.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>

namespace evalbus::metrics {

// Returns the rotation angle 2 acos(|a . b|) between unit quaternions, rad, at most pi; q and -q are the same
// orientation. It is evaluated as 4 atan2(|a - b|, |a + b|) with b's sign such that a . b >= 0. This equals
// the arc cosine but is exact for small angles, where the arc cosine turns one rounding error into 2e-8 rad.
inline double RotationAngle(std::span<const double, 4> a, std::span<const double, 4> b) {
  double dot = 0;
  for (size_t k = 0; k < 4; ++k) dot += a[k] * b[k];
  const double sign = dot < 0 ? -1 : 1;
  double difference = 0, sum = 0;
  for (size_t k = 0; k < 4; ++k) {
    const double d = a[k] - sign * b[k], s = a[k] + sign * b[k];
    difference += d * d;
    sum += s * s;
  }
  return 4 * std::atan2(std::sqrt(difference), std::sqrt(sum));
}

}  // namespace evalbus::metrics
