// Names of processes that machines with a shared file system can tell apart.
#pragma once

#include <string>

namespace evalbus {

// "node7-4711": name of this machine, id of this process.
std::string ThisProcess();

// True only if it is certain that the process of this name ran on this machine and has ended. Always false
// for processes of other machines, also of a container that has another host name.
bool HasEnded(const std::string& process);

}  // namespace evalbus
