// Tests runs in containers that share a network but neither processes nor files.
#include "tests/integration/harness.h"

namespace evalbus::shared_network_test {

namespace fs = std::filesystem;

// Wraps the program so that it is the first process of its container, as in many images.
std::vector<std::string> InContainer(const std::vector<std::string>& program) {
  std::vector<std::string> command = {"unshare", "--pid", "--fork", "--mount-proc", "--kill-child"};
  command.insert(command.end(), program.begin(), program.end());
  return command;
}

TEST(SharedNetwork, RunsOfTwoContainersHaveBusesOfTheirOwn) {
  EVALBUS_NEEDS_BUS();
  if (RunProgram(InContainer({"true"})).code != 0) GTEST_SKIP() << "no pid namespaces on this machine";
  const TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.4);
  const auto command = [&](const char* name) {
    return InContainer({EVALBUS_BINARY_DIR "/bin/evalbus", "run", task, "--episodes", "10", "--policy",
                        "hold", "--out", folder.path() / name});
  };
  Program first(command("first")), second(command("second"));
  EXPECT_EQ(first.Wait(), 0) << first.err();
  EXPECT_EQ(second.Wait(), 0) << second.err();
  ExpectSameScores(folder.path() / "first", folder.path() / "second");
}

}  // namespace evalbus::shared_network_test
