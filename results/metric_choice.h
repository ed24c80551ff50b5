// Finds metrics by the names that users type for --on.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "lcmtypes/metric_catalog.h"

namespace evalbus::results {

// Returns the numbers in `available` (names in summary.json) that a name stands for. The name is the name of
// a number, with or without the prefix "extended.", or the name or label of a metric. The latter stand for
// the metric's main numbers or, if it has none, for all its numbers, for example one per arm. Throws
// InputError if there is none. `metric` of the result is null if the catalog does not contain the number.
std::vector<MetricNumber> FindNumbers(const std::string& name, const std::set<std::string>& available);

}  // namespace evalbus::results
