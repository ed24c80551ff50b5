// How a monitor shows what a RunWatch knows: a screen of a terminal, or lines for what is no terminal.
#pragma once

#include <string>
#include <vector>

#include "viz/terminal/line.h"
#include "viz/watch/run_watch.h"

namespace evalbus::viz {

// The screen: at most height lines, none wider than width. What matters least is left out where there is less
// room. `watch` is of now (RunWatch::Update); url: what to show as the place we listen at.
std::vector<Line> MonitorScreen(const RunWatch& watch, const std::string& url, int width, int height,
                                SteadyTime now);

// The episode so far in one line; empty while none runs.
std::string ProgressLine(const RunWatch& watch);

}  // namespace evalbus::viz
