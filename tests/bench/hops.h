// Where a tick's time goes, from what each bus of a run noted (bus/trace.h).
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// A table for people: of every message of a tick, what it takes to send, until its receiver runs, to decode,
// to work out the answer and to encode that; microseconds, p50 and p99. Throws EnvironmentError if a message
// of the tick is missing.
std::string HopTable(const std::filesystem::path& traces);

}  // namespace evalbus
