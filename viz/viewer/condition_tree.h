// Restores the tree structure of the conditions in EVALBUS_CRITERIA, which is a flat list, from the task
// description.
#pragma once

#include <nlohmann/json.hpp>

#include "models/expression.h"

namespace evalbus::viz {

// Returns indices into the list, starting with `first`, grouped by operators, e.g. 0 or {"all": [0, {"any":
// [1, 2]}]}. In "latched" and "lasts", the last index is the timed condition itself; those before it are its
// operands. A `not` is pushed down to its operands. Returns null if the number of conditions in the
// expression is not `count`.
nlohmann::ordered_json ConditionTree(const Expression& expression, size_t first, size_t count);

}  // namespace evalbus::viz
