// Formats the scores of an episode as a table for a terminal: metrics per arm, with scalar metrics beside
// them or, if the terminal is too narrow, above them.
#pragma once

#include <vector>

#include "evalbus/partial_metrics_t.hpp"
#include "viz/terminal/line.h"

namespace evalbus::viz {

// are_current: false if the scores are from a previous attempt; each number is then shown as "-".
std::vector<RankedLine> MetricTable(const partial_metrics_t& scores, bool are_current, int width);

}  // namespace evalbus::viz
