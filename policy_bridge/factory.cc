#include "policy_bridge/factory.h"

#include <algorithm>
#include <array>

#include "base/errors.h"
#include "policy_bridge/experts/expert.h"
#include "policy_bridge/flawed_policy.h"
#include "policy_bridge/simple_policies.h"

namespace evalbus::policy {
namespace {

constexpr std::array<const char*, 6> kNames = {"expert", "noisy_expert", "random",
                                               "hold",   "replay",       "flawed_expert:FLAW"};
constexpr char kFlawedPrefix[] = "flawed_expert:";

}  // namespace

void CheckPolicyName(const std::string& name) {
  if (name.starts_with(kFlawedPrefix)) {
    FindFlaw(name.substr(sizeof kFlawedPrefix - 1));
    return;
  }
  if (std::find(kNames.begin(), kNames.end(), name) != kNames.end()) return;
  std::string list;
  for (const std::string known : kNames) {
    list += (list.empty() ? "" : ", ") + (known == "replay" ? "replay:RUN_OR_LOG" : known);
  }
  throw InputError("there is no policy \"" + name + "\"; there are: " + list);
}

std::string PolicyHelp() {
  return "expert, noisy_expert, random, hold, replay:RUN_OR_LOG;\nflawed_expert:FLAW fails on purpose: " +
         FlawNames();
}

std::unique_ptr<Policy> MakePolicy(const std::string& name, const mjModel& model, const model_info_t& info,
                                   const Recording& recording) {
  CheckPolicyName(name);
  if (name == "expert") return MakeExpert(model, info);
  if (name == "noisy_expert") return std::make_unique<NoisyPolicy>(MakeExpert(model, info), info);
  if (name.starts_with(kFlawedPrefix)) {
    const Flaw flaw = FindFlaw(name.substr(sizeof kFlawedPrefix - 1));
    return std::make_unique<FlawedPolicy>(MakeExpert(model, info), flaw, model, info);
  }
  if (name == "random") return std::make_unique<RandomPolicy>(info);
  if (name == "hold") return std::make_unique<HoldPolicy>(info);
  return std::make_unique<ReplayPolicy>(recording, info);
}

}  // namespace evalbus::policy
