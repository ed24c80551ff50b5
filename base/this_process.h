// Names of processes that are unique among machines with a shared file system.
#pragma once

#include <string>

namespace evalbus {

// Returns the name of this process, "node7-4711": name of this machine, id of this process.
std::string ThisProcess();

// Returns true if the process with this name ran on a machine with this machine's host name, and no process
// has its id now. Always returns false for processes of machines and containers with another host name.
bool HasEnded(const std::string& process);

}  // namespace evalbus
