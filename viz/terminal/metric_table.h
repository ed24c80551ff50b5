// Formats the scores of an episode as a table for a terminal. Scalar metrics are next to the metrics per arm
// or, if the terminal is too narrow, above them.
#pragma once

#include <vector>

#include "evalbus/partial_metrics_t.hpp"
#include "viz/terminal/line.h"

namespace evalbus::viz {

// are_current: false if the scores are from a previous episode or attempt. Each number is then shown as "-".
std::vector<RankedLine> MetricTable(const partial_metrics_t& scores, bool are_current, int width);

}  // namespace evalbus::viz
