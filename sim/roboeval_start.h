// Draws the initial poses of objects as RoboEval does (commit f36dfd4): objects start where
// env.reset(seed=...) of RoboEval's class places them for the same seed. The numbers come from NumPy's legacy
// generator. Their number and order follow the code of each class; the bounds come from evalbus's task
// variation.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "models/task_description.h"

namespace evalbus::sim {

struct RoboEvalPose {
  // World frame, m. A spawn box draws only x and y.
  std::array<double, 3> position{};
  // Rotation about world z, rad, added to the part's base orientation.
  double yaw = 0;
};

// Returns the drawn poses by object. The variation's alias names the RoboEval class. seed: 0 to 2^32 - 1.
// Throws InputError if the variation has distractors, no class has the name, or the class randomizes a pose
// that the variation does not.
std::map<std::string, RoboEvalPose> DrawRoboEvalStart(const Variation& variation, int64_t seed);

// Throws InputError if the variation does not randomize exactly what the RoboEval class of its alias
// randomizes, or has distractors.
void CheckRoboEvalStart(const Variation& variation);

}  // namespace evalbus::sim
