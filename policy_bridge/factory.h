// Policies by name.
#pragma once

#include <mujoco/mujoco.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/policy.h"

namespace evalbus::policy {

// The actions that were recorded of an episode, in the order of their ticks; empty if there are none.
using Recording = std::function<std::vector<action_t>(int episode)>;

// name: expert, noisy_expert, flawed_expert:FLAW (flawed_policy.h), random, hold, or replay, which plays
// `recording`. Throws InputError that lists the names, or says which tasks the policy is for.
std::unique_ptr<Policy> MakePolicy(const std::string& name, const mjModel& model, const model_info_t& info,
                                   const Recording& recording = {});

// Throws InputError, as MakePolicy does, for a name that no policy has.
void CheckPolicyName(const std::string& name);

// The policies there are, for --help.
std::string PolicyHelp();

}  // namespace evalbus::policy
