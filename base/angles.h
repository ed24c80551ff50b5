// Angles are in radians everywhere inside the programs. Degrees are used only in files and texts for people.
#pragma once

#include <numbers>

namespace evalbus {

// One degree, in rad.
inline constexpr double kDegree = std::numbers::pi / 180;

constexpr double ToDegrees(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }

}  // namespace evalbus
