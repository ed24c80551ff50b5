// Formats the state of a RunWatch as a terminal screen or as lines of text.
#pragma once

#include <string>
#include <vector>

#include "viz/terminal/line.h"
#include "viz/watch/run_watch.h"

namespace evalbus::viz {

// Returns at most `height` lines of at most `width` characters. If there is less room, the least important
// lines are dropped. `watch` must be up to date (RunWatch::Update). url: address of the observed bus, which
// is displayed.
std::vector<Line> MonitorScreen(const RunWatch& watch, const std::string& url, int width, int height,
                                SteadyTime now);

// Returns a one-line summary of the current episode, or an empty text if no episode is running or it has no
// scores yet.
std::string ProgressLine(const RunWatch& watch);

}  // namespace evalbus::viz
