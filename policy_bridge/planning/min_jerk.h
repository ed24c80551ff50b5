// Minimum-jerk motion (Flash and Hogan, 1985) from 0 to 1, with zero velocity and acceleration at both ends.
#pragma once

#include <algorithm>

namespace evalbus::policy {

// Returns the fraction of the distance covered at fraction t of the duration; t is clamped to [0, 1].
inline double MinJerk(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * t * (10 + t * (6 * t - 15));
}

// Returns the derivative of MinJerk(). Its maximum, at t = 0.5, is kMinJerkPeakRate.
inline double MinJerkRate(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return 30 * t * t * (1 - t) * (1 - t);
}

inline constexpr double kMinJerkPeakRate = 1.875;

}  // namespace evalbus::policy
