// How the conditions of EVALBUS_CRITERIA, which are a flat list, hang together: as the task's description has
// them.
#pragma once

#include <nlohmann/json.hpp>

#include "models/expression.h"

namespace evalbus::viz {

// The places in the list, beginning with `first`, under what joins them: 0, {"all": [0, {"any": [1, 2]}]}.
// Under "latched" and "lasts" the last place is the condition itself, of what stands before it. A `not` has
// gone into what it negates. Null where the expression has another number of conditions than `count`.
nlohmann::ordered_json ConditionTree(const Expression& expression, size_t first, size_t count);

}  // namespace evalbus::viz
