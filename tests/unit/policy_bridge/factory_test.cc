#include "policy_bridge/factory.h"

#include <gmock/gmock.h>

#include "base/errors.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::factory_test {

PolicyMaker Nothing() {
  return [](const mjModel&, const model_info_t&) { return std::unique_ptr<Policy>(); };
}

TEST(RegisterPolicy, RefusesNamesThatMeanSomethingElse) {
  const auto refusal = [](const std::string& name) -> std::string {
    try {
      RegisterPolicy(name, "help", Nothing());
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  for (const char* name : {"", "replay:x", "ws://host", "a b", "mine\n", "my/policy", "contract.yaml"}) {
    EXPECT_EQ(refusal(name), "policy name '" + std::string(name) + "': expected letters, digits, _ and -")
        << name;
  }
  EXPECT_EQ(refusal("lcm"), "policy name 'lcm': is the name of a policy in an external process");
  EXPECT_EQ(refusal("roboeval"), "policy name 'roboeval': is the name of a contract");
  EXPECT_EQ(refusal("expert"), "policy name 'expert': is taken");
  EXPECT_EQ(refusal("Mine-2_b"), "");
  EXPECT_EQ(refusal("Mine-2_b"), "policy name 'Mine-2_b': is taken");
}

// Returns the error of making a policy for a copy of LiftPot; empty if there is none.
std::string ErrorOnCopy(const std::string& policy) {
  model_info_t info = GetPolicyScene().info();
  info.task = "my_pot";
  try {
    MakePolicy(policy, GetPolicyScene().model(), info);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Experts, SolveCopiesOfTheirTask) {
  for (const char* policy : {"expert:lift_pot", "noisy_expert:lift_pot", "noisy_expert:0.05:lift_pot",
                             "flawed_expert:drop:lift_pot"}) {
    EXPECT_EQ(ErrorOnCopy(policy), "") << policy;
  }
  for (const std::string policy :
       {"expert", "noisy_expert", "noisy_expert:0.05", "flawed_expert:drop", "flawed_expert:drop:my_pot"}) {
    EXPECT_THAT(ErrorOnCopy(policy), testing::HasSubstr(": task \"my_pot\" has no expert; tasks with one: "));
  }
  EXPECT_THAT(ErrorOnCopy("noisy_expert:0.05"),
              testing::AllOf(testing::StartsWith("policy \"noisy_expert:0.05\": "),
                             testing::EndsWith("(for a copy of one of them, use noisy_expert:0.05:TASK)")));
  EXPECT_EQ(
      ErrorOnCopy("noisy_expert:2"),
      "noisy_expert:2: expected the maximum deviation of a joint, 0 to 1 rad, or a task with an expert");
  EXPECT_EQ(ErrorOnCopy("noisy_expert:lift_pot:"), "policy argument 'lift_pot:': expected a task after ':'");
}

}  // namespace evalbus::policy::factory_test
