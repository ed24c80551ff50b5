// Tests evalbus why with real runs: start parameters and points of no return.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/integration/harness.h"

namespace evalbus::why_test {

namespace fs = std::filesystem;
using nlohmann::json;

class Why : public testing::Test {
 protected:
  fs::path Run(const std::string& policy) {
    const fs::path out = folder_.path() / policy;
    Evaluate({"lift_pot/position", "--policy", policy, "--episodes", "2", "--seed", "1", "--in-process"},
             out);
    return out;
  }

  const TemporaryFolder folder_;
};

// A policy that does nothing leaves the initial state unchanged, so the expert needs the same time from every
// tick as from the reset.
TEST_F(Why, ThePointOfNoReturnLeavesTheExpertItsTime) {
  const fs::path expert = Run("expert"), still = Run("hold");
  const std::string lines = ReadText(expert / "episodes.jsonl");
  const std::string lines_of_still = ReadText(still / "episodes.jsonl");
  const double needed = json::parse(lines.substr(0, lines.find('\n')))["metrics"]["completion_time"];
  const Result result =
      RunProgram({"evalbus", "why", still, "--episode", "0", "--json", folder_.path() / "why.json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json points = json::parse(ReadText(still / "no_return.json"));
  ASSERT_EQ(points.size(), 1);
  EXPECT_EQ(points["0"]["kind"], "out_of_time");
  EXPECT_TRUE(points["0"]["monotone"]);
  // The time limit is 20 s. After the reset the pot falls by 0.4 mm and the hands open; the expert waits up
  // to 0.2 s until the pot and the hands are at rest.
  const double time_s = points["0"]["time_s"];
  EXPECT_NEAR(time_s, 20 - needed, 0.2);
  EXPECT_SAYS(result.out,
              "No parameter of the start separates successes from failures: all 2 episodes failed.");
  EXPECT_SAYS(result.out, points["0"]["text"].get<std::string>());
  const std::string first = lines_of_still.substr(0, lines_of_still.find('\n'));
  // The cause of an episode that is named is printed first.
  EXPECT_THAT(result.out, testing::StartsWith("episode  cause\n      0  " +
                                              json::parse(first)["cause"]["text"].get<std::string>() +
                                              "\n\nNo parameter"));
  EXPECT_SAYS(result.out, "\nthose of all failures: evalbus why ");
  // No parameter can explain equal outcomes, so there is no table of p values.
  EXPECT_EQ(result.out.find("p (Holm)"), std::string::npos) << result.out;
  EXPECT_EQ(json::parse(ReadText(folder_.path() / "why.json"))[0]["episodes"], 2);
  EXPECT_EQ(SchemaError("why", folder_.path() / "why.json"), "");
  EXPECT_EQ(SchemaError("no_return", still / "no_return.json"), "");
  const fs::path page = folder_.path() / "page.html";
  ASSERT_EQ(RunProgram({"evalbus", "report", still, "--mb", "0", "--out", page}).code, 0);
  EXPECT_SAYS(ReadText(page), points["0"]["text"].get<std::string>());
  // Points of no return are not part of the run's results, so they change nothing that `verify` checks.
  EXPECT_EQ(RunProgram({"evalbus", "verify", still, "--write"}).code, 0);
  fs::remove(still / "no_return.json");
  EXPECT_EQ(RunProgram({"evalbus", "verify", still}).code, 0);
}

// A log that was cut off could show a false point of no return.
TEST_F(Why, RefusesTruncatedLogs) {
  const fs::path still = Run("hold"), log = LogFile(still, 0);
  WriteText(log, ReadText(log).substr(0, 100'000));
  const Result result = RunProgram({"evalbus", "why", still, "--failures"});
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.err, log.string() + ": damaged: ");
  EXPECT_FALSE(fs::exists(still / "no_return.json"));
  EXPECT_SAYS(RunProgram({"evalbus", "report", still, "-o", folder_.path() / "page.html"}).out,
              "note: episode 0: " + log.string() + ": damaged: ");
}

TEST_F(Why, UsesTheExpertOfTheTaskThatWasCopied) {
  const fs::path still = folder_.path() / "still";
  ASSERT_EQ(
      RunProgram({"evalbus", "tasks", "new", "my_pot", "--from", "lift_pot"}, {folder_.path(), nullptr}).code,
      0);
  Evaluate({folder_.path() / "my_pot.yaml", "--policy", "hold", "--episodes", "1", "--in-process"}, still);
  const Result refused = RunProgram({"evalbus", "why", still, "--episode", "0"});
  EXPECT_EQ(refused.code, 1);
  EXPECT_SAYS(refused.err, "task \"my_pot\" has no expert; ");
  EXPECT_SAYS(refused.err, "use --expert TASK)");
  EXPECT_SAYS(refused.out, "episode  cause\n      0  ");
  const Result result = RunProgram({"evalbus", "why", still, "--episode", "0", "--expert", "lift_pot"});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_SAYS(result.out, "\nepisode  point of no return\n      0  Point of no return at ");
  EXPECT_SAYS(RunProgram({"evalbus", "why", still, "--expert", "my_pot"}).err,
              "error: --expert: task \"my_pot\" has no expert; ");
}

TEST_F(Why, RefusesEpisodesThatDidNotFail) {
  const fs::path expert = Run("expert");
  const Result result = RunProgram({"evalbus", "why", expert, "--episode", "1"});
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.err, "--episode 1: expected a failed episode of ");
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(RunProgram({"evalbus", "why", folder_.path()}).code, 1);
  EXPECT_SAYS(RunProgram({"evalbus", "why", folder_.path() / "none"}).err, "none: no such run folder");
  EXPECT_SAYS(RunProgram({"evalbus", "why", expert, expert}).err, ": given twice");
}

}  // namespace evalbus::why_test
