// Policies by name.
#pragma once

#include <mujoco/mujoco.h>

#include <functional>
#include <memory>
#include <string>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"

namespace evalbus::policy {

// Makes a policy for the model of a run. Throws InputError, that says which tasks the policy is for, where it
// is not for this one.
using PolicyMaker = std::function<std::unique_ptr<Policy>(const mjModel& model, const model_info_t& info)>;

// name: NAME or NAME:ARGUMENT, as PolicyHelp() lists them. Throws InputError that lists the names, or says
// what is wrong with the argument.
PolicyMaker FindPolicy(const std::string& name);

// Both at once.
std::unique_ptr<Policy> MakePolicy(const std::string& name, const mjModel& model, const model_info_t& info);

// The name of a policy that is a process of the user's on the bus.
inline constexpr char kExternalPolicy[] = "lcm";

// Adds one, before any is looked for (docs/extending.md). help: one line. Throws InputError: the name has
// other characters than letters, digits, _ and -, is taken, or means another policy.
void RegisterPolicy(const std::string& name, const std::string& help, const PolicyMaker& make);

// The policies there are, a line for each, for --help.
std::string PolicyHelp();

}  // namespace evalbus::policy
