// Restores the tree of conditions from the task description. EVALBUS_CRITERIA contains them only as a flat
// list.
#pragma once

#include <nlohmann/json.hpp>

#include "models/expression.h"

namespace evalbus::viz {

// Returns the tree of an expression, in which numbers are indices into the flat list, beginning with `first`.
// Examples: 0, or {"all": [0, {"any": [1, 2]}]}. In "latched" and "lasts", the last index is the timed
// condition itself, and the indices before it are its operands. A `not` is moved down to its operands.
// Returns null if the number of conditions in the expression is not `count`.
nlohmann::ordered_json ConditionTree(const Expression& expression, size_t first, size_t count);

}  // namespace evalbus::viz
