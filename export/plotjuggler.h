// Converts the numbers of a topic for PlotJuggler's UDP server: one JSON object per datagram.
#pragma once

#include <string>
#include <vector>

#include "export/encoder.h"

namespace evalbus::exports {

// Maximum size of a datagram. Networks transmit datagrams of this size without fragmentation.
inline constexpr size_t kDatagramBytes = 1400;

// Returns datagrams such as {"timestamp": time_s, "/metrics/cartesian_path_length_m/left": 0.31, ...}.
// Numbers that do not fit into one datagram follow in further datagrams with the same time stamp. Booleans
// become 0 or 1. Objects in an array are keyed by their "name"; strings and other elements of arrays are
// omitted, and so is a number whose path is too long for a datagram. Empty for a topic without numbers.
std::vector<std::string> Datagrams(const std::string& topic, double time_s, const std::string& json);

}  // namespace evalbus::exports
