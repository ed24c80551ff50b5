// Numbers of a topic as PlotJuggler's UDP server takes them: one JSON object a datagram.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/tools/encoder.h"

namespace evalbus::tools {

// A datagram no network cuts.
inline constexpr size_t kDatagramBytes = 1400;

// {"timestamp": time_s, "/metrics/cartesian_path_length_m/left": 0.31, ...}; what does not fit into one goes
// into further ones of the same time. An array's objects are called by their "name"; texts and other arrays
// are left out. None for a topic without a number.
std::vector<std::string> Datagrams(const std::string& topic, double time_s, const std::string& json);

}  // namespace evalbus::tools
