// Third-party code that the programs load when they start (docs/extending.md): shared libraries that register
// predicates and policies.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace evalbus {

// Environment variables that name plugins as absolute paths, separated by colons. Child processes inherit
// them and load the same plugins. evalbus-metrics loads predicates, evalbus-policy loads policies, and
// evalbus loads both.
inline constexpr const char* kPredicatePlugins = "EVALBUS_PREDICATES";
inline constexpr const char* kPolicyPlugins = "EVALBUS_POLICIES";

// Returns the libraries that one of these variables names.
std::vector<std::filesystem::path> PluginsOf(const char* variable);

// Loads the libraries and lets them register. Returns the program's exit code after one line on stderr if a
// library is missing, is not a plugin, was built with other messages or headers, or registers a name that is
// taken.
std::optional<int> LoadPlugins(const char* variable);

}  // namespace evalbus

// Must be used once in a plugin: EVALBUS_PLUGIN { RegisterPredicate(...); }. The CMake target evalbus::plugin
// defines EVALBUS_PLUGIN_VERSION.
#define EVALBUS_PLUGIN                                                     \
  extern "C" const char evalbus_plugin_version[] = EVALBUS_PLUGIN_VERSION; \
  extern "C" void evalbus_plugin()
