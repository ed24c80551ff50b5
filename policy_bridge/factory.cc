#include "policy_bridge/factory.h"

#include <algorithm>
#include <array>

#include "bus/errors.h"
#include "policy_bridge/expert.h"
#include "policy_bridge/simple_policies.h"

namespace evalbus {
namespace {

constexpr std::array<const char*, 5> kNames = {"expert", "noisy_expert", "random", "hold", "replay"};

}  // namespace

void CheckPolicyName(const std::string& name) {
  if (std::find(kNames.begin(), kNames.end(), name) != kNames.end()) return;
  std::string list;
  for (const char* known : kNames) list += std::string(list.empty() ? "" : ", ") + known;
  throw InputError("there is no policy \"" + name + "\"; there are: " + list);
}

std::unique_ptr<Policy> MakePolicy(const std::string& name, const mjModel& model, const model_info_t& info,
                                   const Recording& recording) {
  CheckPolicyName(name);
  if (name == "expert") return MakeExpert(model, info);
  if (name == "noisy_expert") return std::make_unique<NoisyPolicy>(MakeExpert(model, info), info);
  if (name == "random") return std::make_unique<RandomPolicy>(info);
  if (name == "hold") return std::make_unique<HoldPolicy>(info);
  return std::make_unique<ReplayPolicy>(recording, info);
}

}  // namespace evalbus
