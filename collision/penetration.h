// Penetration depth of two overlapping convex shapes. FCL's own functions cannot be used. Its contact query
// (libccd's MPR) searches along the line of centers and is wrong by centimeters. Its exact function (EPA)
// aborts the process for some inputs.
#pragma once

#include <optional>

#include "collision/shape.h"

namespace evalbus::collision {

// Expanding polytope algorithm (van den Bergen, "Proximity queries and penetration depth computation on 3D
// game objects", 2001). The result is exact for polytopes. For curved shapes, the depth is at most 1e-6 m too
// large, or a few um if rounding ends the search early (needles, parallel faces). Empty if the shapes do not
// overlap, or overlap only by a rounding error. Neither shape may be a plane.
std::optional<Proximity> Penetration(const Shape& a, const Shape& b);

}  // namespace evalbus::collision
