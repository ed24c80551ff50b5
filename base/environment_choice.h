// Chooses between two implementations by an environment variable.
#pragma once

#include <string>

namespace evalbus {

// Returns true if the environment variable is `other`, and false if it is `standard` or not set. Throws
// InputError for other values.
bool EnvironmentSelects(const char* variable, const std::string& other, const std::string& standard);

}  // namespace evalbus
