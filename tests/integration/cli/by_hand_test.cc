// Tests processes that are started by hand, in any order.
#include <signal.h>

#include <map>
#include <memory>
#include <sstream>

#include "bus/channels.h"
#include "evalbus/episode_summary_t.hpp"
#include "metrics/episode/result_json.h"
#include "tests/integration/harness.h"

namespace evalbus::by_hand_test {

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
    // Starts each program only once the previous one is ready.
    ASSERT_TRUE(WaitFor([&] { return program->out() == name + " ready\n"; })) << name << program->err();
  }
  EXPECT_EQ(programs["sim"]->Wait(), 0) << programs["sim"]->err();
  ASSERT_TRUE(WaitFor([&] { return fs::exists(LogFile(out, 1)); }));
  for (auto& [name, program] : programs) {
    if (name == "sim") continue;
    EXPECT_TRUE(program->running()) << name;
    program->Signal(SIGTERM);
    EXPECT_EQ(program->Wait(), 0) << name;
    // All log lines have the level info.
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

// With `evalbus run` as the launcher, the scores are the same. The launcher also prints them and writes a run
// folder.
TEST(ByHandRun, LeavesAFolderLikeAnyOther) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.5) + "/position";
  const std::vector<std::string> what = {task, "--policy", "random", "--episodes", "2", "--seed", "4"};
  std::vector<std::string> in_process = what;
  in_process.push_back("--in-process");
  Evaluate(in_process, folder.path() / "reference");

  const fs::path out = folder.path() / "run";
  const std::string url = UniqueUrl();
  // The environment variable names the bus for all programs.
  const Program::Setting environment{{}, [url] { setenv("EVALBUS_URL", url.c_str(), 1); }};
  std::vector<std::string> command = {"evalbus", "run", "--by-hand", "--out", out};
  command.insert(command.end(), what.begin(), what.end());
  Program run(command, environment);
  ASSERT_TRUE(WaitFor([&] { return run.out().find("/evalbus-sim --options ") != std::string::npos; }))
      << run.err();
  std::vector<std::unique_ptr<Program>> programs;
  for (const std::string name : {"sim", "metrics", "policy", "recorder", "collision"}) {
    // `evalbus run` prints the commands to start. The test starts them without --url, because the environment
    // names the bus.
    const std::string line = "/evalbus-" + name + " --options " + (out / "run.json").string() + " --url";
    EXPECT_NE(run.out().find(line), std::string::npos) << run.out();
    programs.push_back(std::make_unique<Program>(
        std::vector<std::string>{"evalbus-" + name, "--options", out / "run.json"}, environment));
    ASSERT_TRUE(WaitFor([&] { return programs.back()->out() == name + " ready\n"; }))
        << programs.back()->err();
  }
  EXPECT_EQ(run.Wait(), 0) << run.out() << run.err();
  EXPECT_EQ(run.err(), "");
  EXPECT_NE(run.out().find("Success in 0 of 2 episodes"), std::string::npos) << run.out();
  ExpectSameScores(out, folder.path() / "reference");
  for (int i = 0; i < 2; ++i)
    ExpectSameTicks(ReadLog(LogFile(out, i)), ReadLog(LogFile(folder.path() / "reference", i)));
  for (const std::vector<std::string>& reader : {std::vector<std::string>{"evalbus", "report", out},
                                                 {"evalbus", "compare", out, folder.path() / "reference"}}) {
    const Result result = RunProgram(reader);
    EXPECT_EQ(result.code, 0) << result.err;
  }
  for (const auto& program : programs) {
    EXPECT_TRUE(program->running());
    program->Signal(SIGTERM);
    EXPECT_EQ(program->Wait(), 0) << program->err();
  }
}

TEST(ByHandRun, NeedsABus) {
  const Result result = RunProgram({"evalbus", "run", "lift_pot", "--by-hand"});
  EXPECT_EQ(result.code, 1);
  EXPECT_TRUE(
      result.err.starts_with("error: --by-hand: expected one task, one worker, no --in-process, and "))
      << result.err;
}

// Programs take the bus from the environment if the command line names none.
TEST(Environment, NamesTheBus) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::string url = UniqueUrl();
  const Program::Setting environment{{}, [url] { setenv("EVALBUS_URL", url.c_str(), 1); }};
  const std::string task = ShortTask(folder.path(), 0.3);
  const auto run = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> command = {"evalbus",    "run", task,    "--policy",          "hold",
                                        "--episodes", "2",   "--out", folder.path() / name};
    command.insert(command.end(), more.begin(), more.end());
    const Result result = RunProgram(command, environment);
    EXPECT_EQ(result.code, 0) << result.err;
    return nlohmann::json::parse(ReadText(folder.path() / name / "run.json"));
  };
  EXPECT_EQ(run("named", {})["url"], url);
  // --workers and --in-process take precedence over EVALBUS_URL: each worker has its own bus, and one process
  // needs none.
  EXPECT_EQ(run("workers", {"--workers", "2"})["url"], "");
  EXPECT_EQ(run("in_process", {"--in-process"})["url"], "");
  for (const char* name : {"workers", "in_process"})
    ExpectSameScores(folder.path() / "named", folder.path() / name);
  const Result suite =
      RunProgram({"evalbus", "run", "lift_pot/base", "lift_tray/base", "--policy", "flawed_expert:error",
                  "--episodes", "1", "--out", folder.path() / "suite"},
                 environment);
  EXPECT_EQ(suite.code, 0) << suite.err;
  EXPECT_NE(nlohmann::json::parse(ReadText(folder.path() / "suite/lift_pot-base/run.json"))["url"], url);

  Bus bus(url);
  bool is_received = false;
  bus.Subscribe(channels::kEpisodeSummary, [&](const episode_summary_t&) { is_received = true; });
  Program replay({"evalbus", "replay", folder.path() / "named", "--speed", "10"}, environment);
  EXPECT_TRUE(WaitFor([&] {
    bus.Handle();
    return is_received;
  })) << replay.err();
  EXPECT_EQ(replay.Wait(), 0) << replay.out() << replay.err();
  // A run folder also takes precedence. The error does not mention --url, because the user did not pass it.
  const Result over = RunProgram({"evalbus", "monitor", folder.path() / "named"}, environment);
  EXPECT_EQ(over.code, 1);
  EXPECT_NE(over.err.find("this run has finished"), std::string::npos) << over.err;
}

TEST(Programs, MistakesPointToTheHelpOfWhatWasTyped) {
  const auto error = [](const std::vector<std::string>& command) {
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 1);
    return result.err;
  };
  EXPECT_EQ(error({"evalbus", "run", "--episode", "3"}),
            "error: there is no option '--episode'; did you mean '--episodes'? (see 'evalbus run --help')\n");
  EXPECT_EQ(error({"evalbus", "export", "runs/a", "--cvs=a"}),
            "error: there is no option '--cvs'; did you mean '--csv'? (see 'evalbus export --help')\n");
  EXPECT_EQ(error({"evalbus", "tasks", "show"}),
            "error: task is required (see 'evalbus tasks show --help')\n");
  EXPECT_EQ(error({"evalbus", "tasks"}),
            "error: expected a command: check, list, new, show (see 'evalbus tasks --help')\n");
  EXPECT_EQ(error({"evalbus", "tasks", "shwo"}),
            "error: there is no command 'shwo'; did you mean 'show'? (see 'evalbus tasks --help')\n");
  EXPECT_EQ(error({"evalbus", "comapre", "a"}),
            "error: there is no command 'comapre'; did you mean 'compare'? (see 'evalbus --help')\n");
  EXPECT_EQ(error({"evalbus", "nothing"}), "error: there is no command 'nothing' (see 'evalbus --help')\n");
  EXPECT_EQ(error({"evalbus-sim", "--episode", "3"}),
            "error: there is no option '--episode'; did you mean '--episodes'? (see --help)\n");
  EXPECT_EQ(error({"evalbus", "run", "lift_pot", "--in-process", "--policy", "exprt"}),
            "error: there is no policy \"exprt\"; did you mean 'expert'?\n");
  EXPECT_EQ(error({"evalbus", "run", "lift_pot", "--in-process", "--policy", "flawed_expert:dropp"}),
            "error: policy \"flawed_expert\": there is no flaw \"dropp\"; did you mean 'drop'?\n");
}

TEST(Programs, TheCommandAlonePrintsTheGroupedCommands) {
  const Result alone = RunProgram({"evalbus"}), help = RunProgram({"evalbus", "--help"});
  EXPECT_EQ(alone.code, 0);
  EXPECT_EQ(alone.err, "");
  EXPECT_EQ(alone.out, help.out);
  size_t at = 0;
  for (const std::string line :
       {"\nEvaluate:\n  run  ", "\nWatch:\n  web  ", "\nCompare:\n  compare  ", "\nRecord:\n  collect  ",
        "\nExtend:\n  tasks  ", "\nMachine:\n  doctor  ", "\nOptions:\n"}) {
    const size_t found = help.out.find(line, at);
    ASSERT_NE(found, std::string::npos) << line << help.out;
    at = found;
  }
}

TEST(Programs, HelpOfEachCommandFitsTheTerminalAndHasThreeExamples) {
  // Each command has one line; the commands of a group are indented.
  std::istringstream lines(RunProgram({"evalbus", "--help"}).out);
  std::vector<std::string> commands;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 100u) << line;
    if (line.starts_with("  ") && line[2] >= 'a' && line[2] <= 'z')
      commands.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  EXPECT_EQ(commands.size(), 28u);
  Program::Setting narrow;
  narrow.before = [] { setenv("COLUMNS", "72", 1); };
  for (const std::string& command : commands) {
    std::istringstream help(RunProgram({"evalbus", command, "--help"}, narrow).out);
    int examples = -1;
    for (std::string line; std::getline(help, line);) {
      if (examples >= 0) {
        ++examples;
        continue;  // example commands are not wrapped, because users copy them
      }
      if (line == "Examples:") examples = 0;
      // A name or a default value without blanks may exceed the line length.
      if (line.find(' ', 28) != std::string::npos) {
        EXPECT_LE(line.size(), 72u) << command << ": " << line;
      }
    }
    EXPECT_EQ(examples, 3) << command;
  }
}

TEST(Programs, OptionsOfARunAreInGroups) {
  const std::string help = RunProgram({"evalbus", "run", "--help"}).out;
  for (const std::string group :
       {"Policy", "Episodes", "Simulation", "Output", "Bus and processes", "Plans"}) {
    EXPECT_NE(help.find("\n" + group + ":\n  --"), std::string::npos) << group;
  }
  // All options except --help are in a named group.
  EXPECT_NE(
      help.find("\nOther options:\n  -h,--help                 print this help and exit\n\nExamples:\n"),
      std::string::npos)
      << help;
}

TEST(Programs, HelpIsUsefulAndNoError) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> programs = {
      {{"evalbus"}, "score"},
      {{"evalbus", "run"}, "--control-hz"},
      {{"evalbus", "score"}, "--collision-sample-window"},
      {{"evalbus", "doctor"}, "fix"},
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
    // The description precedes the usage line.
    EXPECT_GT(result.out.find("Usage:"), 20u) << command[0];
  }
  const std::string version = RunProgram({"evalbus", "--version"}).out;
  EXPECT_TRUE(version.starts_with("evalbus ")) << version;
  const std::string number = version.substr(8, version.find(' ', 8) - 8);
  for (const std::string name : {"sim", "collision", "metrics", "policy", "recorder", "viz", "monitor"}) {
    const Result result = RunProgram({"evalbus-" + name, "--version"});
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_EQ(result.out, "evalbus-" + name + " " + number + "\n");
  }
}

TEST(Programs, ComponentsEndOnBothStopSignals) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::string url = UniqueUrl();
  for (const int signal : {SIGTERM, SIGINT}) {
    Program sim({"evalbus-sim", "lift_pot", "--out", folder.path(), "--url", url});
    ASSERT_TRUE(WaitFor([&] { return sim.out() == "sim ready\n"; })) << sim.err();
    sim.Signal(signal);
    EXPECT_EQ(sim.Wait(), 0);
    EXPECT_EQ(sim.err(), "");
  }
}

}  // namespace evalbus::by_hand_test
