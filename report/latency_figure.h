// Figure with curves of success, completion time and jerk against the inference delay.
#pragma once

#include <string>
#include <vector>

#include "results/latency_curve.h"

namespace evalbus::report {

// Returns a stand-alone SVG image with one line per execution mode, in the order of `points`, and 95 %
// intervals.
std::string LatencyFigure(const std::string& title, const std::vector<results::DelayPoint>& points);

}  // namespace evalbus::report
