// Which bus a run can have on this machine.
#pragma once

#include <string>

#include "bus/reserved_bus.h"

namespace evalbus {

// Names the bus for every program that is not told another one by its command line.
inline constexpr char kUrlVariable[] = "EVALBUS_URL";
// Its value; empty without one.
std::string UrlOfEnvironment();

// Empty if multicast works at this URL, else one line that says why not.
std::string WhyNoMulticast(const std::string& url);

// Moves this process, before it has started any thread, into a network namespace of its own with multicast on
// its loopback interface. Children share it; nobody else hears it. Throws EnvironmentError, one line.
void EnterPrivateNetwork();

// The bus to use, said on stdout with the reason: the one asked for, or the first that works of this
// machine's multicast and multicast in a private network, which is then entered; none if neither does.
// Throws InputError or EnvironmentError if the one asked for does not work: it is never replaced.
ReservedBus ChooseBus(const std::string& asked);

}  // namespace evalbus
