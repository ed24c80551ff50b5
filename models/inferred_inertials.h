// Inertias that MuJoCo inferred from geoms, as <inertial> elements. The inferred values depend on MuJoCo's
// version. They are marked, so that a simulation process of another version can replace them by its own.
#pragma once

#include <mujoco/mujoco.h>
#include <tinyxml2.h>

namespace evalbus::mjcf {

// Gives every body that has mass but no <inertial> the inertia that it has in `model`, which must have been
// compiled from this document.
void AddInferredInertials(tinyxml2::XMLElement* worldbody, const mjModel& model);

// Removes the elements that AddInferredInertials added. Returns whether there were any.
bool RemoveInferredInertials(tinyxml2::XMLElement* worldbody);

}  // namespace evalbus::mjcf
