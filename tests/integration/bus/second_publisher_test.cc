// Somebody else publishes on the bus of a run: the run has the undisturbed run's scores, or stops and says
// why.
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

// The lines of the run's episodes.jsonl are the first ones of the reference's.
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
  // Runs beside it; what the run says in the end must be `why`.
  void ExpectRefusal(const std::string& why) {
    Program launcher(RunCommand(run_, "1", {"--url", url_}));
    EXPECT_EQ(launcher.Wait(), 2);
    EXPECT_NE(launcher.err().find(why), std::string::npos) << launcher.err();
    EXPECT_FALSE(fs::exists(run_ / "episodes.jsonl")) << ReadText(run_ / "episodes.jsonl");
  }

  TemporaryFolder folder_;
  const fs::path reference_ = folder_.path() / "reference", run_ = folder_.path() / "run";
  const std::string url_ = UniqueUrl();
};

TEST_F(SecondPublisher, ASecondSimIsNamed) {
  Program second({"evalbus-sim", "lift_pot", "--out", (folder_.path() / "other").string(), "--url", url_});
  ASSERT_TRUE(Ready(&second)) << second.err();
  ExpectRefusal("is a second sim on this bus, or a log being played?");
}

class Second : public SecondPublisher, public testing::WithParamInterface<const char*> {};

TEST_P(Second, ComponentIsNamed) {
  std::vector<std::string> command = {std::string("evalbus-") + GetParam(), "--url", url_};
  if (std::string(GetParam()) == "policy") command.insert(command.end(), {"--policy", "hold"});
  Program second(command);
  ASSERT_TRUE(Ready(&second)) << second.err();
  ExpectRefusal(std::string("two processes on this bus say that they are the ") + GetParam());
}

INSTANTIATE_TEST_SUITE_P(Each, Second, testing::Values("collision", "metrics", "policy"),
                         [](const auto& test) { return std::string(test.param); });

// Some channels of an old run's logs, and of which seed and policy that was.
struct OldRun {
  const char* name;
  const char* seed;
  const char* policy;
  const char* channels;
};

class OldLog : public SecondPublisher, public testing::WithParamInterface<OldRun> {};

// lcm-logplayer, again and again, into a run that goes on.
TEST_P(OldLog, PlayedIntoARunChangesNoScore) {
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
  const int code = launcher.Wait();
  EXPECT_GT(played, 0);
  if (code == 0) {
    ExpectSameScores(run_, reference_);
  } else {
    EXPECT_EQ(code, 2);
    EXPECT_TRUE(launcher.err().starts_with("error: ")) << launcher.err();
    ExpectNoOtherScores(run_, reference_);
  }
}

INSTANTIATE_TEST_SUITE_P(Of, OldLog,
                         testing::Values(OldRun{"OurSeed", "1", "expert", ".*"},
                                         OldRun{"AnotherSeed", "2", "expert", ".*"},
                                         OldRun{"AnotherPolicy", "1", "random", "EVALBUS_[^M].*"},
                                         OldRun{"ScoresOnly", "1", "random", "EVALBUS_.*_SUMMARY"}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace evalbus::second_publisher_test
