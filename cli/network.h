// Which bus a run can have on this machine.
#pragma once

#include <string>

namespace evalbus {

// Empty if multicast works at this URL, else one line that says why not.
std::string WhyNoMulticast(const std::string& url);

// Moves this process, before it has started any thread, into a network namespace of its own with multicast on
// its loopback interface. Children share it; nobody else hears it. Throws EnvironmentError, one line.
void EnterPrivateNetwork();

}  // namespace evalbus
