// Chooses the bus of a run on this machine.
#pragma once

#include <string>

#include "bus/reserved_bus.h"

namespace evalbus {

// Environment variable with the bus URL of every program that has no --url on its command line.
inline constexpr char kUrlVariable[] = "EVALBUS_URL";
// Returns the value of kUrlVariable; empty if it is not set.
std::string UrlOfEnvironment();

// Tests whether multicast works with this URL. Returns one line that explains why not; empty if it works.
std::string WhyNoMulticast(const std::string& url);

// Moves this process into a new network namespace with multicast on its loopback interface. Must be called
// before any thread has started. Child processes share the namespace; other processes receive nothing from
// it. Throws EnvironmentError, one line.
void EnterPrivateNetwork();

// Chooses the bus. If `asked` is not empty, only that bus is used; throws InputError or EnvironmentError if
// it does not work. Otherwise, uses this machine's multicast or, if that does not work, enters a private
// network with multicast, and prints the bus on stdout. Returns no bus if neither works. Throws
// EnvironmentError if no free port is found.
ReservedBus ChooseBus(const std::string& asked);

}  // namespace evalbus
