// Shows where the time of a tick is spent, from the traces of each bus of a run (bus/trace.h).
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Returns a human-readable table of every message of a tick: microseconds (p50 and p99) to send it, until its
// receiver runs, to decode it, to compute the answer and to encode the answer. Throws EnvironmentError if a
// message of the tick is in no trace.
std::string HopTable(const std::filesystem::path& traces);

}  // namespace evalbus
