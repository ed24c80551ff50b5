// Limits of positions in task descriptions, robot descriptions and live sources.
#pragma once

namespace evalbus {

// Limit in m along each axis of the world frame. For much larger positions, MuJoCo reports an unstable
// simulation.
inline constexpr double kFarthest = 1000;
// The same limit for parts and robots of descriptions, and for objects in the first sample of a source. A
// manipulation scene is smaller, so a larger number is probably in millimeters or centimeters.
inline constexpr double kFarthestPart = 10;

}  // namespace evalbus
