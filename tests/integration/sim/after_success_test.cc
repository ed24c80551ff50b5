// Tests episodes that continue after a success, in several processes and in one.
#include "tests/integration/harness.h"

namespace evalbus::after_success_test {

namespace fs = std::filesystem;

// The tray reaches its place, which is a success, and then the hand releases it.
TEST(AfterSuccess, ASuccessThatDoesNotHoldCountsAndIsMarked) {
  EVALBUS_NEEDS_BUS();
  const TemporaryFolder folder;
  const std::vector<std::string> task = {
      "lift_tray/drag_over", "--policy", "flawed_expert:drop", "--seed", "1", "--episodes", "1"};
  const auto run = [&](const std::string& name, const std::vector<std::string>& options) {
    std::vector<std::string> arguments = task;
    arguments.insert(arguments.end(), options.begin(), options.end());
    Evaluate(arguments, folder.path() / name);
    return Episodes(folder.path() / name).at(0);
  };
  const auto processes = run("processes", {"--after-success-s", "1"});
  const auto one = run("one", {"--after-success-s", "1", "--in-process"});
  EXPECT_EQ(processes, one);
  ExpectSameTicks(ReadLog(LogFile(folder.path() / "processes", 0)),
                  ReadLog(LogFile(folder.path() / "one", 0)));

  auto plain = run("plain", {"--in-process"}), gone_on = one;
  EXPECT_EQ(gone_on["end_reason"], "success");
  auto& extended = gone_on["extended"];
  EXPECT_EQ(extended["success_once"], 1.0);
  EXPECT_EQ(extended["success_end"], 0.0);
  EXPECT_GT(extended["success_held_s"], 0.0);
  EXPECT_LT(extended["success_held_s"], 1.0);
  for (const char* key : {"success_once", "success_end", "success_held_s"}) {
    EXPECT_FALSE(plain["extended"].contains(key)) << key;
    extended.erase(key);
  }
  EXPECT_EQ(gone_on, plain);

  for (const char* name : {"processes", "one", "plain"}) {
    const Result rescored = RunProgram({"evalbus", "rescore", folder.path() / name});
    EXPECT_EQ(rescored.code, 0) << rescored.out << rescored.err;
  }
  // A replay also plays the actions after the success.
  Evaluate({"lift_tray/drag_over", "--policy", "replay:" + (folder.path() / "one").string(), "--seed", "1",
            "--episodes", "1", "--after-success-s", "1", "--in-process"},
           folder.path() / "replayed");
  EXPECT_EQ(Episodes(folder.path() / "replayed").at(0), one);
}

}  // namespace evalbus::after_success_test
