// When two geoms touch.
#pragma once

namespace evalbus {

// Contact = signed distance at most this, m.
inline constexpr double kContactDistance = 1e-8;

}  // namespace evalbus
