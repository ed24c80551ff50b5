#include "bus/live_runs.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::live_runs_test {

namespace fs = std::filesystem;

class LiveRunsTest : public testing::Test {
 protected:
  LiveRunsTest() { Process("self", {"test"}, "net:[1]"); }

  void Process(const std::string& pid, const std::vector<std::string>& command, const std::string& network) {
    fs::create_directories(proc_.path() / pid / "ns");
    std::ofstream stream(proc_.path() / pid / "cmdline", std::ios::binary);
    for (const std::string& argument : command) stream << argument << '\0';
    fs::create_symlink(network, proc_.path() / pid / "ns/net");
  }

  TemporaryFolder proc_;
};

TEST_F(LiveRunsTest, FindsRunsByTheirProcesses) {
  Process("999991", {"/bin/evalbus-policy", "--url", "udpm://a"}, "net:[1]");
  Process("999992", {"/bin/evalbus-sim", "lift_pot", "--out", "/runs/a", "--url", "udpm://a"}, "net:[1]");
  Process("999993", {"evalbus-metrics", "--url=udpm://b"}, "net:[7]");
  Process("999994", {"evalbus-monitor", "--url", "udpm://c"}, "net:[1]");
  Process("999997", {"evalbus-viz", "--url", "udpm://c"}, "net:[1]");
  Process("999995", {"vi", "--url", "udpm://d"}, "net:[1]");
  Process("999996", {"evalbus-metrics", "--help"}, "net:[1]");
  const std::vector<LiveRun> runs = FindLiveRuns(proc_.path());
  ASSERT_EQ(runs.size(), 2u);
  const LiveRun a = ChooseLiveRun(runs, "udpm://a"), b = ChooseLiveRun(runs, "udpm://b");
  EXPECT_EQ(a.folder, "/runs/a");
  EXPECT_FALSE(a.other_network);
  EXPECT_TRUE(b.other_network);
  EXPECT_EQ(b.pid, 999993);
}

// A process that is started by hand may have its bus in the environment and a folder relative to its working
// folder.
TEST_F(LiveRunsTest, FindsRunsStartedByHand) {
  Process("999991", {"evalbus-recorder", "--out", "runs/a"}, "net:[1]");
  std::ofstream(proc_.path() / "999991/environ", std::ios::binary)
      << "PATH=/bin" << '\0' << "EVALBUS_URL=udpm://a" << '\0';
  fs::create_symlink("/home/me", proc_.path() / "999991/cwd");
  const LiveRun run = ChooseLiveRun(FindLiveRuns(proc_.path()));
  EXPECT_EQ(run.url, "udpm://a");
  EXPECT_EQ(run.folder, "/home/me/runs/a");
}

TEST_F(LiveRunsTest, FindsRunsAndReplaysByTheirFolder) {
  Process("999991", {"evalbus-sim", "--options", "/runs/a/run.json", "--url", "udpm://a"}, "net:[1]");
  Process("999992", {"evalbus-metrics", "--url", "udpm://b", kReplayOption, "/runs/b"}, "net:[1]");
  Process("999993", {"evalbus-sim", "--options", "/runs/suite/c/run.json", "--url", "udpm://c"}, "net:[1]");
  const auto runs = FindLiveRuns(proc_.path());
  EXPECT_EQ(ChooseLiveRun(LiveRunsOf(runs, "/runs/a")).url, "udpm://a");
  EXPECT_EQ(ChooseLiveRun(LiveRunsOf(runs, "/runs/../runs/b/")).url, "udpm://b");
  EXPECT_EQ(ChooseLiveRun(LiveRunsOf(runs, "/runs/suite")).url, "udpm://c") << "one of its runs";
  EXPECT_TRUE(LiveRunsOf(runs, "/runs/d").empty());
  try {
    ChooseLiveRun(runs);
    FAIL();
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("runs/a on udpm://a"), std::string::npos) << message;
    EXPECT_NE(message.find("replay of "), std::string::npos) << message;
    EXPECT_NE(message.find("runs/b on udpm://b"), std::string::npos) << message;
  }
}

TEST_F(LiveRunsTest, ChoosesOnlyWhereThereIsNoChoice) {
  EXPECT_THROW(ChooseLiveRun(FindLiveRuns(proc_.path()), ""), InputError);
  Process("999991", {"evalbus-sim", "--url", "udpm://a", "--out", "/runs/a"}, "net:[1]");
  EXPECT_EQ(ChooseLiveRun(FindLiveRuns(proc_.path()), "").url, "udpm://a");
  EXPECT_THROW(ChooseLiveRun(FindLiveRuns(proc_.path()), "udpm://b"), InputError);
  Process("999992", {"evalbus-sim", "--url", "udpm://b", "--out", "/runs/b"}, "net:[1]");
  try {
    ChooseLiveRun(FindLiveRuns(proc_.path()), "");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("/runs/a"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("/runs/b"), std::string::npos) << error.what();
  }
}

// On a shared machine, any user can start a program named evalbus-sim.
TEST_F(LiveRunsTest, ProcessesOfOtherUsersAreIgnored) {
  if (geteuid() != 0) GTEST_SKIP() << "only root has files of other users";
  constexpr uid_t kNobody = 65534;
  Process("999991", {"evalbus-sim", "--url", "udpm://a", "--out", "/runs/a"}, "net:[1]");
  Process("999992", {"evalbus-sim", "--url", "udpm://b", "--out", "/runs/a"}, "net:[1]");
  ASSERT_EQ(chown((proc_.path() / "999991").c_str(), kNobody, kNobody), 0);
  const auto runs = FindLiveRuns(proc_.path());
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].url, "udpm://b");
}

TEST(JoinNetwork, OfAnotherUsersProcessIsRefused) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can start processes of other users";
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t other = fork();
  if (other == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const bool good = unshare(CLONE_NEWNET) == 0 && setresuid(65534, 65534, 65534) == 0 &&
                      prctl(PR_SET_DUMPABLE, 1) == 0 && write(ready[1], "r", 1) == 1;
    if (!good) _exit(1);
    for (;;) pause();
  }
  close(ready[1]);
  char byte = 0;
  const bool is_there = read(ready[0], &byte, 1) == 1;
  close(ready[0]);
  LiveRun run;
  run.pid = other;
  run.url = "udpm://a";
  std::string refusal;
  try {
    if (is_there) JoinNetwork(run);
  } catch (const EnvironmentError& error) {
    refusal = error.what();
  }
  kill(other, SIGKILL);
  waitpid(other, nullptr, 0);
  if (!is_there) GTEST_SKIP() << "no network namespaces on this machine";
  EXPECT_NE(refusal.find("belongs to another user"), std::string::npos) << refusal;
}

}  // namespace evalbus::live_runs_test
