// Which geom pairs of a compiled model are checked for contact. Rules: checker.h.
#pragma once

#include <mujoco/mujoco.h>

#include <evalbus/model_info_t.hpp>
#include <utility>
#include <vector>

namespace evalbus::collision {

// Pairs (a, b), a < b, sorted. `info` must describe `model`.
std::vector<std::pair<int, int>> CheckedPairs(const mjModel& model, const model_info_t& info);

}  // namespace evalbus::collision
