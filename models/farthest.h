// Limits of positions in task descriptions, robot descriptions and live sources.
#pragma once

namespace evalbus {

// Limit in m along each axis of the world frame. For much larger positions, MuJoCo reports an unstable
// simulation.
inline constexpr double kFarthest = 1000;
// The same limit for parts and robots of descriptions: a manipulation scene is smaller, so a larger number
// is probably in millimeters.
inline constexpr double kFarthestPart = 10;

}  // namespace evalbus
