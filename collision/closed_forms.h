// Signed distance, contact point and normal of shape pairs with an exact closed form. These are pairs of a
// plane and any shape, of spheres and capsules, and of a sphere or capsule and a box. All poses are in the
// world frame, lengths in m.
#pragma once

#include "collision/shape.h"

namespace evalbus::collision {

// The shape of the plane is the half-space below its local z = 0. If a whole face or edge of the other shape
// is equally deep, its center is the contact point.
Proximity PlaneToShape(const Shape& plane, const Shape& other);

// A sphere is treated as a capsule of length zero. The contact point of parallel capsules is in the middle of
// their overlap.
Proximity CapsuleToCapsule(const Shape& a, const Shape& b);

// The result is exact even if the capsule's axis passes through the box.
Proximity CapsuleToBox(const Shape& capsule, const Shape& box);

}  // namespace evalbus::collision
