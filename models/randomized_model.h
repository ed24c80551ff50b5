// What an episode's seed changes of a compiled model: masses and frictions, which count in physics, and
// colors, lights and cameras, which are only seen. Where things are is the world's (sim/world.h).
//
// Each kind has random numbers of its own, so that what is seen changes nothing of what happens.
#pragma once

#include <mujoco/mujoco.h>

#include <cstdint>
#include <string>
#include <vector>

#include "models/task_description.h"

namespace evalbus {

// A randomized parameter of an episode; the name ends in its unit ("pot_x_m", "pot_yaw_rad",
// "pot_mass_factor").
struct Parameter {
  std::string name;
  double value = 0;
};

// Both take a model as it was compiled, and throw InputError at the line of a name that it does not have.

// Masses and frictions of a physics model. The model's constants that depend on masses are worked out anew
// where one has changed.
std::vector<Parameter> RandomizePhysics(const Variation& variation, int64_t seed, mjModel* model);
// Colors, lights and cameras of a visual model.
std::vector<Parameter> RandomizeAppearance(const Variation& variation, int64_t seed, mjModel* model);

}  // namespace evalbus
