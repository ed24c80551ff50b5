// Runs commands that are implemented by a module of python/evalbus, because they use Python packages of the
// user.
#pragma once

#include <string>
#include <vector>

namespace evalbus::commands {

// Replaces this process by Python, which runs MODULE with these arguments (python/evalbus/start_module.py),
// with evalbus' package in its import path. Uses the interpreter in EVALBUS_PYTHON or, if it is not set,
// python3 from PATH, which belongs to the user's environment with the required packages. Throws
// EnvironmentError if this fails; otherwise does not return.
[[noreturn]] void ExecPythonModule(const std::string& module, const std::vector<std::string>& arguments);

}  // namespace evalbus::commands
