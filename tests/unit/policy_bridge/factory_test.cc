#include "policy_bridge/factory.h"

#include <gmock/gmock.h>

#include "base/errors.h"

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

}  // namespace evalbus::policy::factory_test
