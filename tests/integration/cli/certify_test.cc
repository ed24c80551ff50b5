// Tests evalbus certify, and that runs of different versions of MuJoCo are not compared. This machine may
// have only one version, so our own sim under another name stands in for a second one.
#include <gmock/gmock.h>
#include <unistd.h>

#include "runner/engines.h"
#include "runner/processes.h"
#include "tests/integration/harness.h"

namespace evalbus::certify_test {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using testing::HasSubstr;
using testing::StartsWith;

class Certify : public testing::Test {
 protected:
  Certify() { fs::create_symlink("evalbus-sim", program_); }
  ~Certify() override { fs::remove(program_); }

  Result Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"evalbus", "certify"});
    return RunProgram(arguments);
  }
  static void ExpectError(const Result& result, const std::string& text) {
    EXPECT_EQ(result.code, 1) << result.out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(text));
  }

  // The process id makes the name unique, because other tests may run at the same time.
  const std::string stand_in_ = "8.8." + std::to_string(getpid());
  const fs::path program_ = runner::Processes::BinaryFolder() / runner::SimProgram(stand_in_);
  const std::string own_ = runner::EngineVersion("");
  TemporaryFolder folder_;
  const std::string out_ = folder_.path() / "out";
};

TEST_F(Certify, TheSameEngineUnderTwoNamesFlipsNothing) {
  EVALBUS_NEEDS_BUS();
  const std::string task = ShortTask(folder_.path(), 0.4) + "/position";
  const std::vector<std::string> command = {task,         "--engines",   own_ + "," + stand_in_,
                                            "--policies", "hold,random", "--episodes",
                                            "2",          "--out",       out_};
  const Result result = Run(command);
  ASSERT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("No verdict flips: 0 of 4 episodes flip between MuJoCo " + own_ +
                                    " and " + stand_in_ + "; the ranking of the policies is the same.\n"));
  EXPECT_EQ(SchemaError("certificate", fs::path(out_) / "certificate.json"), "");
  const auto json = ordered_json::parse(ReadText(fs::path(out_) / "certificate.json"));
  EXPECT_EQ(json["engines"], (std::vector{own_, stand_in_}));
  ASSERT_EQ(json["comparisons"].size(), 2u);
  for (const auto& one : json["comparisons"]) {
    EXPECT_EQ(one["pairs"], 2);
    EXPECT_EQ(one["different"], 0);
  }
  const auto run_of = [&](const std::string& version) {
    const fs::path policy = fs::path(out_) / version / "random";
    for (const auto& entry : fs::directory_iterator(policy)) {
      if (fs::exists(entry.path() / "run.json")) return entry.path();
    }
    return policy;
  };
  const fs::path own = run_of(own_), other = run_of(stand_in_);
  const auto info = ordered_json::parse(ReadText(other / "run.json"));
  EXPECT_EQ(info["engine"], stand_in_);
  EXPECT_EQ(info["mujoco_version"], stand_in_);
  EXPECT_EQ(ReadText(own / "episodes.jsonl"), ReadText(other / "episodes.jsonl"));

  // Finished episodes are not run again, and a different plan is refused.
  ExpectError(Run(command), "exists and is not an empty folder");
  const auto written = fs::last_write_time(own / "episodes/0001/summary.json");
  std::vector<std::string> again = command;
  again.emplace_back("--resume");
  EXPECT_EQ(Run(again).code, 0);
  EXPECT_EQ(fs::last_write_time(own / "episodes/0001/summary.json"), written);
  again.insert(again.end(), {"--seed", "9"});
  ExpectError(Run(again), "the plan in this folder differs: \"seed\" is 0 there, not 9");

  const Result compared = RunProgram({"evalbus", "compare", own, other});
  ExpectError(compared, " was simulated by MuJoCo " + own_ + " and ");
  EXPECT_EQ(RunProgram({"evalbus", "compare", own, other, "--across-engines"}).code, 0);
  // Episodes of two engines never enter the same run.
  ExpectError(RunProgram({"evalbus", "merge", folder_.path() / "merged", own, other}), "mujoco_version");
  ExpectError(RunProgram({"evalbus", "run", "--like", other, "--engine", own_, "--out", other, "--resume"}),
              "mujoco_version");
}

TEST_F(Certify, MistakesAreOneLine) {
  const auto engines = [&](const std::string& list) {
    return Run({"lift_pot/position", "--engines", list, "--episodes", "1", "--out", out_});
  };
  ExpectError(engines(own_ + ",7.7.7"), "--engines 7.7.7: not built; 'scripts/engine 7.7.7' builds it");
  ExpectError(engines(own_), "--engines: expected two or more versions");
  ExpectError(engines(own_ + "," + own_), "--engines: MuJoCo " + own_ + " is given twice");
  const auto policies = [&](const std::string& list) {
    return Run({"lift_pot/position", "--engines", own_ + "," + stand_in_, "--policies", list, "--out", out_});
  };
  ExpectError(policies("expert,nonsense"), "nonsense");
  ExpectError(policies("ws://127.0.0.1:8000"), "a policy server requires a name: list it in a plan file");
  WriteText(folder_.path() / "plan.yaml", "policies: [hold]\ntasks: lift_pot/position\nepisodes: 1\n");
  ExpectError(
      Run({folder_.path() / "plan.yaml", "--engines", own_ + "," + stand_in_, "--seed", "3", "--out", out_}),
      "--seed: ");
  // Nothing was written.
  EXPECT_FALSE(fs::exists(out_));
}

}  // namespace evalbus::certify_test
