// Processes that a person starts, in any order.
#include <signal.h>

#include <map>
#include <memory>
#include <sstream>

#include "bus/channels.h"
#include "evalbus/episode_summary_t.hpp"
#include "metrics/episode/result_json.h"
#include "tests/integration/harness.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

class ByHand : public testing::TestWithParam<std::vector<std::string>> {};

TEST_P(ByHand, AnyOrderOfStartsGivesTheSameScores) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.5) + "/position";
  Evaluate({task, "--policy", "random", "--episodes", "2", "--seed", "4", "--in-process"},
           folder.path() / "reference");
  const auto expected = Episodes(folder.path() / "reference");

  const std::string url = UniqueUrl(), out = folder.path() / "run";
  std::map<std::string, std::unique_ptr<Program>> programs;
  for (const std::string& name : GetParam()) {
    std::vector<std::string> command = {"evalbus-" + name, "--url", url};
    if (name == "sim")
      command.insert(command.end(), {task, "--out", out, "--episodes", "2", "--seed", "4", "--require",
                                     "collision,metrics,policy,recorder"});
    if (name == "policy") command.insert(command.end(), {"--policy", "random"});
    if (name == "recorder") command.insert(command.end(), {"--out", out});
    auto& program = programs[name] = std::make_unique<Program>(command);
    // The next one only once this one is there.
    ASSERT_TRUE(WaitFor([&] { return program->out() == "ready\n"; })) << name << program->err();
  }
  EXPECT_EQ(programs["sim"]->Wait(), 0) << programs["sim"]->err();
  ASSERT_TRUE(WaitFor([&] { return fs::exists(LogFile(out, 1)); }));
  for (auto& [name, program] : programs) {
    if (name == "sim") continue;
    EXPECT_TRUE(program->running()) << name;
    program->Signal(SIGTERM);
    EXPECT_EQ(program->Wait(std::chrono::seconds(5)), 0) << name;
    // What it noticed, which is nothing to worry about.
    std::istringstream lines(program->err());
    for (std::string line; std::getline(lines, line);) {
      EXPECT_NE(line.find(" [info] " + name), std::string::npos) << line;
    }
  }
  for (int i = 0; i < 2; ++i) {
    const RecordedLog log = ReadLog(LogFile(out, i));
    ExpectSameTicks(log, ReadLog(LogFile(folder.path() / "reference", i)));
    const auto summary = log.Messages(channels::kEpisodeSummary).at(0);
    EXPECT_EQ(summary.complete, 1);
    EXPECT_EQ(summary.seed, expected[static_cast<size_t>(i)]["seed"]);
    EXPECT_EQ(metrics::ResultJson(summary.metrics), expected[static_cast<size_t>(i)]["metrics"]);
  }
}

using Order = std::vector<std::string>;
INSTANTIATE_TEST_SUITE_P(Orders, ByHand,
                         testing::Values(Order{"sim", "policy", "metrics", "collision", "recorder"},
                                         Order{"recorder", "collision", "metrics", "policy", "sim"},
                                         Order{"policy", "metrics", "sim", "recorder", "collision"}),
                         [](const auto& test) { return test.param.front() + "First"; });

TEST(Programs, HelpIsUsefulAndNoError) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> programs = {
      {{"evalbus"}, "score"},
      {{"evalbus", "run"}, "--control-hz"},
      {{"evalbus", "score"}, "--collision-sample-window"},
      {{"evalbus", "doctor"}, "mend"},
      {{"evalbus-sim"}, "--episodes"},
      {{"evalbus-collision"}, "CONTACTS"},
      {{"evalbus-metrics"}, "--url"},
      {{"evalbus-policy"}, "noisy_expert"},
      {{"evalbus-recorder"}, "--out"}};
  for (auto [command, word] : programs) {
    command.push_back("--help");
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 0) << command[0];
    EXPECT_EQ(result.err, "") << command[0];
    EXPECT_NE(result.out.find(word), std::string::npos) << command[0] << " --help: " << result.out;
    // What it is for comes before what it is called with.
    EXPECT_GT(result.out.find("Usage:"), 20u) << command[0];
  }
  const Result version = RunProgram({"evalbus", "--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_TRUE(version.out.starts_with("evalbus ")) << version.out;
}

TEST(Programs, ComponentsEndOnBothStopSignals) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::string url = UniqueUrl();
  for (const int signal : {SIGTERM, SIGINT}) {
    Program sim({"evalbus-sim", "lift_pot", "--out", folder.path(), "--url", url});
    ASSERT_TRUE(WaitFor([&] { return sim.out() == "ready\n"; })) << sim.err();
    sim.Signal(signal);
    EXPECT_EQ(sim.Wait(std::chrono::seconds(5)), 0);
    EXPECT_EQ(sim.err(), "");
  }
}

}  // namespace
}  // namespace evalbus
