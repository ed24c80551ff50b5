// Tests plugin policies that misbehave in Act(), in one process and in several.
#include <cstdlib>

#include "tests/integration/harness.h"

namespace evalbus::plugin_policy_test {

namespace fs = std::filesystem;

class PluginPolicy : public testing::Test {
 protected:
  PluginPolicy() { setenv("EVALBUS_POLICIES", BAD_POLICIES, 1); }
  ~PluginPolicy() override { unsetenv("EVALBUS_POLICIES"); }

  std::vector<std::string> Command(const std::string& policy, const fs::path& out, bool in_process) const {
    std::vector<std::string> command = {"evalbus",    "run", task_,   "--policy", policy,
                                        "--episodes", "4",   "--out", out};
    if (in_process) command.push_back("--in-process");
    return command;
  }

  // Returns the end reason and detail of episode 1. Expects the other episodes to be unaffected.
  std::string EndOfEpisode1(const std::string& policy, bool in_process) {
    const fs::path out = folder_.path() / (policy + (in_process ? "_in_process" : "_in_processes"));
    const Result result = RunProgram(Command(policy, out, in_process));
    EXPECT_EQ(result.code, 0) << result.out << result.err;
    const auto episodes = Episodes(out);
    EXPECT_EQ(episodes.size(), 4u);
    if (episodes.size() != 4) return "";
    for (const int i : {0, 2, 3}) EXPECT_EQ(episodes[i]["end_reason"], "time_limit") << policy << i;
    for (const auto& episode : episodes) EXPECT_EQ(episode["complete"], true);
    return episodes[1]["end_reason"].get<std::string>() + ": " + episodes[1]["end_detail"].get<std::string>();
  }

  TemporaryFolder folder_;
  const std::string task_ = ShortTask(folder_.path(), 0.4);
};

TEST_F(PluginPolicy, OneExceptionEndsOneEpisodeHoweverTheRunIsCut) {
  EXPECT_EQ(EndOfEpisode1("throws", true), "policy_error: no grasp found");
  std::vector<std::string> command = Command("throws", folder_.path() / "workers", true);
  command.insert(command.end(), {"--workers", "2"});
  const Result result = RunProgram(command);
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  ExpectSameScores(folder_.path() / "throws_in_process", folder_.path() / "workers");
}

TEST_F(PluginPolicy, AnExceptionOfAnyTypeEndsItsEpisode) {
  const std::string end = "policy_error: the policy threw an exception that is not a std::exception";
  EXPECT_EQ(EndOfEpisode1("throws_a_number", true), end);
  EVALBUS_NEEDS_BUS();
  EXPECT_EQ(EndOfEpisode1("throws_a_number", false), end);
}

TEST_F(PluginPolicy, SizesThatDisagreeEndTheEpisode) {
  EXPECT_EQ(EndOfEpisode1("says_more_joints_than_it_has", true),
            "policy_error: the policy set num_joints to 1000000, but joint_position_rad has 14 values");
  EXPECT_EQ(EndOfEpisode1("says_fewer_grippers_than_it_has", true),
            "policy_error: the policy set num_grippers to 1, but gripper_closing has 2 values");
}

TEST_F(PluginPolicy, AMissingOneIsAnError) {
  const Result result = RunProgram(Command("missing", folder_.path() / "missing", true));
  EXPECT_EQ(result.code, 1) << result.out;
  EXPECT_EQ(result.err, "error: policy 'missing': its plugin returned none\n");
}

TEST_F(PluginPolicy, ExitFailsTheRun) {
  const std::string line =
      "error: exit(0) was called before the end of the program; a plugin must return or throw instead\n";
  const Result alone = RunProgram(Command("exits", folder_.path() / "alone", true));
  EXPECT_EQ(alone.code, 2);
  EXPECT_EQ(alone.err, line);
  EVALBUS_NEEDS_BUS();
  const Result many = RunProgram(Command("exits", folder_.path() / "many", false));
  EXPECT_EQ(many.code, 2) << many.out;
  EXPECT_NE(many.err.find(line.substr(0, line.size() - 1)), std::string::npos) << many.err;
}

}  // namespace evalbus::plugin_policy_test
