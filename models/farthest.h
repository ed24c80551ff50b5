// Limit of positions in task descriptions, robot descriptions and live sources.
#pragma once

namespace evalbus {

// Limit in m along each axis of the world frame. For much larger positions, MuJoCo reports an unstable
// simulation.
inline constexpr double kFarthest = 1000;

}  // namespace evalbus
