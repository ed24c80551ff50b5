// The scores of an episode as a table for a terminal: metrics by arm, and beside them, or above where there
// is no room, those that are one number.
#pragma once

#include <vector>

#include "evalbus/partial_metrics_t.hpp"
#include "viz/terminal/line.h"

namespace evalbus::viz {

// Without `are_current` the scores are of an attempt before: every number is "-" in its place.
std::vector<RankedLine> MetricTable(const partial_metrics_t& scores, bool are_current, int width);

}  // namespace evalbus::viz
