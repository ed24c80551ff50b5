// The start of an episode as RoboEval draws it (commit f36dfd4): objects start where env.reset(seed=...) of
// RoboEval's class places them for the same seed. The numbers come from NumPy's legacy generator. Their count
// and order follow from the code of each class; the bounds are those of our task's variation.
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
  // About world z, rad, added to the part's base orientation.
  double yaw = 0;
};

// Returns the drawn values by object. The class is the variation's alias; seed: 0 to 2^32 - 1. Throws
// InputError as CheckRoboEvalStart().
std::map<std::string, RoboEvalPose> DrawRoboEvalStart(const Variation& variation, int64_t seed);

// Throws InputError if the variation randomizes the starts of other objects than RoboEval's class of its
// alias does.
void CheckRoboEvalStart(const Variation& variation);

}  // namespace evalbus::sim
