// Tests runs on a bus on which other processes also publish. Such a run either has the scores of an
// undisturbed run, or stops and states the reason.
#include <sstream>

#include "tests/integration/harness.h"

namespace evalbus::second_publisher_test {

namespace fs = std::filesystem;

std::vector<std::string> RunCommand(const fs::path& out, const std::string& seed,
                                    const std::vector<std::string>& more) {
  std::vector<std::string> command = {"evalbus",    "run", "lift_pot/position", "--out", out, "--seed", seed,
                                      "--episodes", "2",   "--control-hz",      "50"};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

// Expects the lines of the run's episodes.jsonl to be the first lines of the reference's.
void ExpectNoOtherScores(const fs::path& run, const fs::path& reference) {
  std::istringstream lines(ReadText(run / "episodes.jsonl")),
      expected(ReadText(reference / "episodes.jsonl"));
  std::string line, expected_line;
  while (std::getline(lines, line)) {
    ASSERT_TRUE(std::getline(expected, expected_line));
    EXPECT_EQ(line, expected_line);
  }
}

class SecondPublisher : public testing::Test {
 protected:
  void SetUp() override {
    EVALBUS_NEEDS_BUS();
    ASSERT_EQ(RunProgram(RunCommand(reference_, "1", {"--in-process"})).code, 0);
  }
  bool Ready(Program* program) {
    return WaitFor([&] { return program->out().find(" ready\n") != std::string::npos; });
  }

  TemporaryFolder folder_;
  const fs::path reference_ = folder_.path() / "reference", run_ = folder_.path() / "run";
  const std::string url_ = UniqueUrl();
};

// The second sim announces its own episode continuously.
TEST_F(SecondPublisher, ASecondSimIsIgnored) {
  Program second({"evalbus-sim", "lift_pot", "--out", (folder_.path() / "other").string(), "--url", url_,
                  "--episodes", "1000"});
  ASSERT_TRUE(Ready(&second)) << second.err();
  Program launcher(RunCommand(run_, "1", {"--url", url_}));
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  ExpectSameScores(run_, reference_);
}

TEST_F(SecondPublisher, TwoRunsOnOneBusDoNotDisturbEachOther) {
  Program one(RunCommand(run_, "1", {"--url", url_})),
      two(RunCommand(folder_.path() / "two", "1", {"--url", url_}));
  EXPECT_EQ(one.Wait(), 0) << one.err();
  EXPECT_EQ(two.Wait(), 0) << two.err();
  ExpectSameScores(run_, reference_);
  ExpectSameScores(folder_.path() / "two", reference_);
}

class Second : public SecondPublisher, public testing::WithParamInterface<const char*> {};

// A component that is started by hand joins any session that it receives.
TEST_P(Second, ComponentIsNamed) {
  std::vector<std::string> command = {std::string("evalbus-") + GetParam(), "--url", url_};
  if (std::string(GetParam()) == "policy") command.insert(command.end(), {"--policy", "hold"});
  Program second(command);
  ASSERT_TRUE(Ready(&second)) << second.err();
  Program launcher(RunCommand(run_, "1", {"--url", url_}));
  const int code = launcher.Wait();
  if (code == 0) {
    // The run had finished before the second process was ready for one of its episodes.
    ExpectSameScores(run_, reference_);
    return;
  }
  EXPECT_EQ(code, 2);
  EXPECT_NE(launcher.err().find(std::string("two processes on this bus claim to be the ") + GetParam()),
            std::string::npos)
      << launcher.err();
  if (fs::exists(run_ / "episodes.jsonl")) ExpectNoOtherScores(run_, reference_);
}

INSTANTIATE_TEST_SUITE_P(Each, Second, testing::Values("collision", "metrics", "policy"),
                         [](const auto& test) { return std::string(test.param); });

// Some channels of an old run's logs, and the seed and policy of that run.
struct OldRun {
  const char* name;
  const char* seed;
  const char* policy;
  const char* channels;
};

class OldLog : public SecondPublisher, public testing::WithParamInterface<OldRun> {};

// lcm-logplayer plays an old log repeatedly into an active run.
TEST_P(OldLog, PlayedIntoARunIsIgnored) {
  const fs::path old = folder_.path() / "old";
  ASSERT_EQ(
      RunProgram(RunCommand(old, GetParam().seed, {"--in-process", "--policy", GetParam().policy})).code, 0);
  Program launcher(RunCommand(run_, "1", {"--url", url_}));
  int played = 0;
  while (launcher.running() && played < 40) {
    for (int episode = 0; episode < 2 && launcher.running(); ++episode, ++played) {
      Program player({"lcm-logplayer", "--speed", "50", "--regexp", GetParam().channels, "--lcm-url", url_,
                      LogFile(old, episode)});
      WaitFor([&] { return !player.running() || !launcher.running(); });
    }
  }
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  EXPECT_GT(played, 0);
  ExpectSameScores(run_, reference_);
}

INSTANTIATE_TEST_SUITE_P(Of, OldLog,
                         testing::Values(OldRun{"OurSeed", "1", "expert", ".*"},
                                         OldRun{"AnotherSeed", "2", "expert", ".*"},
                                         OldRun{"AnotherPolicy", "1", "random", "EVALBUS_[^M].*"},
                                         OldRun{"ScoresOnly", "1", "random", "EVALBUS_.*_SUMMARY"}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace evalbus::second_publisher_test
