// Commands that a module of python/evalbus carries out, because they use Python packages of the user.
#pragma once

#include <string>
#include <vector>

namespace evalbus::commands {

// Replaces this process by `python3 -B -m MODULE ARGUMENT...`, with evalbus' own package in its import path.
// Python is the program that EVALBUS_PYTHON names, else python3 of PATH: the user's environment, which has
// the packages. Returns only by throwing EnvironmentError.
[[noreturn]] void ExecPythonModule(const std::string& module, const std::vector<std::string>& arguments);

}  // namespace evalbus::commands
