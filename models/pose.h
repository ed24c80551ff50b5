// Position and orientation of one frame relative to another.
#pragma once

#include <array>

namespace evalbus {

struct Pose {
  // Position of the origin, m.
  std::array<double, 3> position{0, 0, 0};
  // Unit quaternion (w, x, y, z).
  std::array<double, 4> quaternion{1, 0, 0, 0};

  bool operator==(const Pose&) const = default;
};

}  // namespace evalbus
