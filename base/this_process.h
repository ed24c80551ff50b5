// Names of processes that are unique among machines with a shared file system.
#pragma once

#include <string>

namespace evalbus {

// Returns the name of this process, "node7-4711": name of this machine, id of this process.
std::string ThisProcess();

// Returns true only if it is certain that the process with this name ran on this machine and has ended.
// Always returns false for processes of other machines, and for processes of a container that has another
// host name.
bool HasEnded(const std::string& process);

}  // namespace evalbus
