// Policies by name.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "policy_bridge/policy.h"

#include <mujoco/mujoco.h>

namespace evalbus {

// Recorded actions of an earlier run, by episode, in the order of their ticks.
using Recording = std::map<int, std::vector<action_t>>;

// name: "expert", "noisy_expert", "random", "hold" or "replay", which plays `recording`. Throws InputError that lists the
// names, or says which tasks the policy is for.
std::unique_ptr<Policy> MakePolicy(const std::string& name, const mjModel& model, const model_info_t& info,
                                   const Recording& recording);

// Throws InputError, as MakePolicy does, for a name that no policy has.
void CheckPolicyName(const std::string& name);

}  // namespace evalbus
