// Limit of positions in task descriptions, robot descriptions and live sources.
#pragma once

namespace evalbus {

// m, along each axis of the world frame. MuJoCo reports an unstable simulation for much larger ones.
inline constexpr double kFarthest = 1000;

}  // namespace evalbus
