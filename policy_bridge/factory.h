// Creates policies by name.
#pragma once

#include <mujoco/mujoco.h>

#include <functional>
#include <memory>
#include <string>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"

namespace evalbus::policy {

// Creates a policy for the model of a run. If the policy does not support the run's task, throws InputError
// with the supported tasks.
using PolicyMaker = std::function<std::unique_ptr<Policy>(const mjModel& model, const model_info_t& info)>;

// name: NAME or NAME:ARGUMENT, as listed by PolicyHelp(). Throws InputError with the valid names, or with the
// reason why the argument is invalid.
PolicyMaker FindPolicy(const std::string& name);

// Calls FindPolicy() and then its result.
std::unique_ptr<Policy> MakePolicy(const std::string& name, const mjModel& model, const model_info_t& info);

// Policy name that stands for an external process on the bus.
inline constexpr char kExternalPolicy[] = "lcm";

// Registers a policy; must be called before any FindPolicy() (docs/extending.md). help: one line. Throws
// InputError if the name contains characters other than letters, digits, _ and -, is already registered, or
// would select another policy.
void RegisterPolicy(const std::string& name, const std::string& help, const PolicyMaker& make);

// Returns the list of available policies, one line each, for --help.
std::string PolicyHelp();

}  // namespace evalbus::policy
