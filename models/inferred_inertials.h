// Inertias that MuJoCo inferred from geoms, as <inertial> elements. The inferred values depend on MuJoCo's
// version, so they are marked: a simulation process of another version replaces them by its own.
#pragma once

#include <mujoco/mujoco.h>
#include <tinyxml2.h>

namespace evalbus::mjcf {

// Gives every body without an <inertial> the inertia that it has in `model`, which must be this document,
// compiled.
void AddInferredInertials(tinyxml2::XMLElement* worldbody, const mjModel& model);

// Removes the elements that AddInferredInertials added. Returns whether there were any.
bool RemoveInferredInertials(tinyxml2::XMLElement* worldbody);

}  // namespace evalbus::mjcf
