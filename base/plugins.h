// Code of others that the programs load when they start (docs/extending.md): shared libraries that register
// predicates and policies.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace evalbus {

// Variables of the environment, so that programs that are started by others load the same: lists of absolute
// paths with colons. Predicates are for what reads tasks, policies for what runs them.
inline constexpr const char* kPredicatePlugins = "EVALBUS_PREDICATES";
inline constexpr const char* kPolicyPlugins = "EVALBUS_POLICIES";

// The libraries that one of them names.
std::vector<std::filesystem::path> PluginsOf(const char* variable);

// Loads them and lets them register. Where that fails, after one line on stderr, the program's exit code: a
// library is missing, is none or was made for another version, or a name that it registers is taken.
std::optional<int> LoadPlugins(const char* variable);

}  // namespace evalbus

// Once in a plugin: EVALBUS_PLUGIN { RegisterPredicate(...); }. The target evalbus::plugin knows the version.
#define EVALBUS_PLUGIN                                                     \
  extern "C" const char evalbus_plugin_version[] = EVALBUS_PLUGIN_VERSION; \
  extern "C" void evalbus_plugin()
