// Names of processes that machines with a shared file system can tell apart.
#pragma once

#include <string>

namespace evalbus {

// "node7-4711": name of this machine, id of this process.
std::string ThisProcess();

// True only where it is certain: the process of this name was one of this machine's and is gone. Processes of
// other machines are never said to have ended.
bool HasEnded(const std::string& process);

}  // namespace evalbus
