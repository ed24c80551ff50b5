// Angles are radians everywhere inside; degrees are for people and files.
#pragma once

#include <numbers>

namespace evalbus {

// rad
inline constexpr double kDegree = std::numbers::pi / 180;

constexpr double ToDegrees(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }

}  // namespace evalbus
