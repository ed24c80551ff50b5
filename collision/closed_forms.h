// Signed distance, contact point and normal of shape pairs with an exact closed form: a plane and any shape,
// spheres and capsules, and spheres or capsules and boxes. FCL computes the other pairs. All poses are in the
// world frame, lengths in m.
#pragma once

#include "collision/shape.h"

namespace evalbus::collision {

// The plane's shape includes everything below its local z = 0. If a whole face or edge is equally deep, its
// center is used.
Proximity PlaneToShape(const Shape& plane, const Shape& other);

// A sphere is a capsule of length zero. The contact point of parallel capsules is in the middle of their
// overlap.
Proximity CapsuleToCapsule(const Shape& a, const Shape& b);

// Also exact if the capsule's axis passes through the box.
Proximity CapsuleToBox(const Shape& capsule, const Shape& box);

}  // namespace evalbus::collision
