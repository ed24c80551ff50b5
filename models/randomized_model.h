// Applies an episode's randomization to a compiled model: masses and frictions of the physics model; colors,
// lights, textures and cameras of the visual model. Initial positions are set by sim/world.h.
//
// Physics and appearance use separate random streams, so that changes of appearance do not affect the
// physics. Textures and the poses of lights have their own streams, so that adding them to a variation does
// not change its other draws.
#pragma once

#include <mujoco/mujoco.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "models/task_description.h"

namespace evalbus {

// A randomized parameter of an episode. Its name ends in the unit ("pot_x_m", "pot_yaw_rad",
// "pot_mass_factor"), or in "_choice" if the value is an index into a list of choices.
struct Parameter {
  std::string name;
  double value = 0;
};

// Both functions require a freshly compiled model. They throw InputError at the line of a name that the model
// does not contain.

// Changes masses and frictions of a physics model, and recomputes the model's constants that depend on
// masses.
std::vector<Parameter> RandomizePhysics(const Variation& variation, int64_t seed, mjModel* model);
// Changes colors, lights, textures and cameras of a visual model.
std::vector<Parameter> RandomizeAppearance(const Variation& variation, int64_t seed, mjModel* model);

// Throws InputError at the variation if two entries of its 'randomize' draw parameters of the same name.
void CheckDistinct(const std::vector<Parameter>& parameters, const Variation& variation);

// Returns the lists of choices from which a variation's "_choice" parameters are drawn, by the parameter's
// name.
std::map<std::string, std::vector<std::string>> ParameterChoices(const Variation& variation);
// Returns the ids in a visual model of all textures that episodes of the variation may have. Throws
// InputError at the line of a texture that the model does not contain.
std::vector<int> TexturesOf(const Variation& variation, const mjModel& model);

}  // namespace evalbus
