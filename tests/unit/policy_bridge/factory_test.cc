#include "policy_bridge/factory.h"

#include <gtest/gtest.h>

#include <sstream>

#include "base/errors.h"
#include "policy_bridge/policies/flawed_policy.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::factory_test {

std::string Refusal(const std::string& name) {
  try {
    FindPolicy(name);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Factory, EveryPolicyIsFoundByItsName) {
  for (const char* name : {"expert", "expert:lift_pot", "noisy_expert", "noisy_expert:0.03", "random", "hold",
                           "flawed_expert:drop"}) {
    EXPECT_EQ(Refusal(name), "accepted");
    EXPECT_TRUE(MakePolicy(name, GetPolicyScene().model(), GetPolicyScene().info())) << name;
  }
  // Any file may be a log; it is read when an episode begins.
  EXPECT_EQ(Refusal("replay:" EVALBUS_SOURCE_DIR "/README.md"), "accepted");
}

TEST(Factory, WrongNamesAreExplained) {
  const auto unknown = [](const std::string& name) {
    return "there is no policy \"" + name +
           "\"; there are: expert[:TASK], noisy_expert[:RAD], random, hold, replay:RUN_OR_LOG, "
           "replay_anyway:RUN_OR_LOG, demo:FILE_OR_FOLDER, flawed_expert:FLAW; and contracts of servers "
           "('evalbus policy list')";
  };
  for (const char* name : {"exprt", "", "expert:", "hold:1", "Expert", "replay_"})
    EXPECT_EQ(Refusal(name), unknown(name));
  EXPECT_EQ(Refusal("noisy_expert:3"), "noisy_expert:3: expected 0 to 1, the most that a joint is off, rad");
  EXPECT_EQ(Refusal("noisy_expert:0.1x"),
            "noisy_expert:0.1x: expected 0 to 1, the most that a joint is off, rad");
  EXPECT_EQ(Refusal("replay"),
            "policy \"replay\": replay:PATH expected, with a run folder or an LCM event log");
  EXPECT_EQ(Refusal("replay:"), Refusal("replay"));
  EXPECT_EQ(Refusal("replay:/nowhere"), "policy \"replay\": /nowhere does not exist");
  EXPECT_EQ(Refusal("replay:/"), "policy \"replay\": / is no run folder: it has no folder episodes/");
  const std::string flaws = "; there are: miss, slip, early, drop, stop, collide, slow, error, nan";
  EXPECT_EQ(Refusal("flawed_expert:dropp"), "policy \"flawed_expert\": there is no flaw \"dropp\"" + flaws);
  EXPECT_EQ(Refusal("flawed_expert"), "policy \"flawed_expert\": there is no flaw \"\"" + flaws);
}

TEST(Factory, HelpHasALineForEachPolicy) {
  std::istringstream help(PolicyHelp());
  std::vector<std::string> usages;
  for (std::string line; std::getline(help, line);) usages.push_back(line.substr(0, line.find(": ")));
  EXPECT_EQ(usages, (std::vector<std::string>{"expert[:TASK]", "noisy_expert[:RAD]", "random", "hold",
                                              "replay:RUN_OR_LOG", "replay_anyway:RUN_OR_LOG",
                                              "demo:FILE_OR_FOLDER", "flawed_expert:FLAW"}));
  EXPECT_NE(PolicyHelp().find(FlawNames()), std::string::npos);
}

TEST(Factory, AnExpertSaysWhichTasksItIsFor) {
  model_info_t info = GetPolicyScene().info();
  info.task = "fold_towel";
  for (const char* name : {"expert", "noisy_expert", "flawed_expert:slow"}) {
    try {
      MakePolicy(name, GetPolicyScene().model(), info);
      FAIL();
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("lift_pot"), std::string::npos) << error.what();
    }
  }
  EXPECT_NO_THROW(MakePolicy("hold", GetPolicyScene().model(), info));
  // A copy of a task is played by the expert of the task it was copied from.
  EXPECT_NO_THROW(MakePolicy("expert:lift_pot", GetPolicyScene().model(), info));
  EXPECT_EQ(Refusal("expert:fold_towel").substr(0, 57),
            "policy \"expert\": there is none for task \"fold_towel\"; the");
}

}  // namespace evalbus::policy::factory_test
