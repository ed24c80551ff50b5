// Signed distance, contact point and normal of shape pairs that have an exact closed form: a plane against
// everything, spheres and capsules against each other, and spheres and capsules against boxes. FCL covers the
// other pairs. All poses are in the world frame, lengths in meters.
#pragma once

#include "collision/shape.h"

namespace evalbus::collision {

// The plane fills everything below its local z = 0. Where a whole face or edge is equally deep, its center is
// taken.
Proximity PlaneToShape(const Shape& plane, const Shape& other);

// A sphere is a capsule of length zero. Parallel capsules meet in the middle of their overlap.
Proximity CapsuleToCapsule(const Shape& a, const Shape& b);

// Exact also where the capsule's axis runs through the box.
Proximity CapsuleToBox(const Shape& capsule, const Shape& box);

}  // namespace evalbus::collision
