// Selects the geom pairs of a compiled model that are checked for contact. checker.h defines the rules.
#pragma once

#include <mujoco/mujoco.h>

#include <evalbus/model_info_t.hpp>
#include <utility>
#include <vector>

namespace evalbus::collision {

// Returns the checked pairs (a, b) with a < b, sorted. `info` must describe `model`.
std::vector<std::pair<int, int>> CheckedPairs(const mjModel& model, const model_info_t& info);

}  // namespace evalbus::collision
