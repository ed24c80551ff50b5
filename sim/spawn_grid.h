// The grid points of a spawn plane.
#pragma once

#include <array>
#include <cmath>
#include <string>

#include "base/errors.h"
#include "base/text.h"
#include "models/randomization.h"

namespace evalbus::sim {

class SpawnGrid {
 public:
  // Throws InputError if there are fewer points than objects.
  explicit SpawnGrid(const SpawnPlane& plane)
      : plane_(plane),
        nx_(Count(2 * plane.half_extents[0], plane.spacing)),
        ny_(Count(2 * plane.half_extents[1], plane.spacing)) {
    if (static_cast<size_t>(size()) < plane.objects.size()) {
      throw InputError(
          plane.location.ToString() + ": spawn_plane: expected at least one grid point per object, got " +
          Plural(size(), "point") + " for " + Plural(static_cast<int64_t>(plane.objects.size()), "object"));
    }
  }

  const SpawnPlane& plane() const { return plane_; }
  int size() const { return nx_ * ny_; }

  // Returns a grid point in the world frame, m. Points are numbered along y first.
  std::array<double, 3> Point(int number) const {
    const int row = number / ny_, column = number % ny_;
    return {plane_.origin[0] + (row - (nx_ - 1) / 2.0) * plane_.spacing,
            plane_.origin[1] + (column - (ny_ - 1) / 2.0) * plane_.spacing, plane_.origin[2]};
  }

 private:
  // Python's extent // spacing, as RoboEval computes it. The result is one less than expected if the double
  // nearest to the spacing is slightly too large: 0.5 // 0.05 is 9.
  static int Count(double extent, double spacing) {
    return static_cast<int>(std::lround((extent - std::fmod(extent, spacing)) / spacing));
  }

  SpawnPlane plane_;
  int nx_, ny_;
};

}  // namespace evalbus::sim
