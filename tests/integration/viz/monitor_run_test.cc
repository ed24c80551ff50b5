// Monitors that start late, hang or are numerous do not affect the run.
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <optional>

#include "lcmtypes/end_reason.h"
#include "tests/integration/harness.h"

namespace evalbus::monitor_run_test {

namespace fs = std::filesystem;

// Returns the command of a run of short episodes in which the robot holds still.
std::vector<std::string> RunCommand(const fs::path& folder, const std::string& name, const std::string& url,
                                    const std::vector<std::string>& more = {}) {
  std::vector<std::string> command = {
      "evalbus", "run",   ShortTask(folder, 4), "--policy",     "hold", "--url",
      url,       "--out", folder / name,        "--control-hz", "200"};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

int Count(const std::string& text, const std::string& words) {
  int count = 0;
  for (size_t at = 0; (at = text.find(words, at)) != std::string::npos; at += words.size()) ++count;
  return count;
}

// Every component that the monitor reported as silent publishes again. On a loaded machine a component may be
// delayed.
void ExpectNoComponentIsMissed(const std::string& out) {
  EXPECT_EQ(Count(out, "no message from "), Count(out, " publishes again\n")) << out;
}

// A run that waited for the monitor would never end.
TEST(MonitorRun, AHangingMonitorNeitherStopsNorChangesTheRun) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const Result alone = RunProgram(RunCommand(folder.path(), "alone", UniqueUrl(), {"--episodes", "4"}));
  ASSERT_EQ(alone.code, 0) << alone.out << alone.err;
  const std::string url = UniqueUrl();
  Program hanging({"evalbus-monitor", "--url", url}), listening({"evalbus", "monitor", "--url", url});
  ASSERT_TRUE(WaitFor([&] { return !hanging.out().empty() && !listening.out().empty(); }));
  Program run(RunCommand(folder.path(), "watched", url, {"--episodes", "4"}));
  // Stops the monitor in the middle of the run, after it has received messages.
  ASSERT_TRUE(WaitFor([&] { return hanging.out().find("episode 0 begins") != std::string::npos; }));
  hanging.Signal(SIGSTOP);
  ASSERT_TRUE(run.running());
  EXPECT_EQ(run.Wait(), 0) << run.err();
  EXPECT_EQ(run.out().find("retrying"), std::string::npos) << run.out();
  ExpectSameScores(folder.path() / "alone", folder.path() / "watched");
  for (int i = 0; i < 4; ++i) {
    ExpectSameTicks(ReadLog(LogFile(folder.path() / "alone", i)),
                    ReadLog(LogFile(folder.path() / "watched", i)));
  }
  hanging.Signal(SIGCONT);
  // Both monitors report the end of the run and exit.
  for (Program* monitor : {&hanging, &listening}) {
    EXPECT_EQ(monitor->Wait(), 0) << monitor->err();
    EXPECT_NE(monitor->out().find("the run has ended"), std::string::npos) << monitor->out();
  }
  // The run's table shows the same reason.
  const std::string reason = end_reason::Text(Episodes(folder.path() / "watched").at(3)["failure_reason"]);
  EXPECT_NE(listening.out().find("episode 3 " + reason + " after 4.00 s"), std::string::npos)
      << listening.out();
  ExpectNoComponentIsMissed(listening.out());
  EXPECT_NE(listening.out().find("4 done, success 0 %"), std::string::npos) << listening.out();
}

TEST(MonitorRun, OpenedInMidEpisodeShowsWhatCameBefore) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  Program run(
      RunCommand(folder.path(), "run", UniqueUrl(), {"--episodes", "5", "--only", "0,1", "--realtime"}));
  ASSERT_TRUE(WaitFor([&] {
    std::error_code error;
    return fs::file_size(folder.path() / "run/episodes/0001.partial/events.lcmlog", error) > 100'000 &&
           !error;
  })) << run.out()
      << run.err();
  // The monitor starts while the run is stopped, so that it does not start after the run on a loaded machine.
  std::vector<pid_t> processes = ChildrenOf(run.pid());
  processes.push_back(run.pid());
  std::optional<Stopped> stopped(processes);
  // The monitor finds the run by its folder. The number of planned episodes is in run.json; the number of
  // finished ones was published before.
  Program monitor({"evalbus", "monitor", folder.path() / "run"});
  ASSERT_TRUE(WaitFor([&] { return monitor.out().starts_with("listening to "); })) << monitor.err();
  stopped.reset();
  for (const char* text : {"1 of 2 done", "episode 1  "}) {
    EXPECT_TRUE(WaitFor([&] { return monitor.out().find(text) != std::string::npos; })) << monitor.out();
  }
  monitor.Signal(SIGINT);
  EXPECT_EQ(monitor.Wait(), 0);
  EXPECT_EQ(run.Wait(), 0) << run.err();
}

TEST(MonitorRun, FindsARunInAPrivateNetwork) {
  if (RunProgram({"true"}, {"",
                            [] {
                              if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0)
                                _exit(125);
                            }})
          .code != 0)
    GTEST_SKIP() << "no network namespaces here";
  TemporaryFolder folder;
  // The episode takes longer than the start of a monitor on a loaded machine. The run ends with this test.
  Program run({"evalbus", "run", ShortTask(folder.path(), 3600), "--policy", "hold", "--realtime",
               "--episodes", "1", "--out", folder.path() / "run"},
              {"", [] {
                 if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) _exit(125);
               }});
  ASSERT_TRUE(WaitFor([&] { return fs::exists(folder.path() / "run/episodes/0000.partial"); }))
      << run.out() << run.err();
  ASSERT_NE(run.out().find("private network namespace"), std::string::npos) << run.out();
  Program monitor({"evalbus", "monitor", folder.path() / "run"});
  EXPECT_TRUE(WaitFor([&] { return monitor.out().find("episode 0  ") != std::string::npos; }))
      << monitor.out() << monitor.err();
  monitor.Signal(SIGTERM);
  EXPECT_EQ(monitor.Wait(), 0);
}

TEST(MonitorRun, FindsAReplayAndReportsTheEndOfARun) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  Evaluate({ShortTask(folder.path(), 4), "--policy", "hold", "--episodes", "1", "--in-process"}, run);
  for (const std::string program : {"evalbus-monitor", "evalbus-viz"}) {
    const Result result = RunProgram({program, run});
    EXPECT_EQ(result.code, 1);
    EXPECT_EQ(result.err, "error: " + run.string() + ": this run has finished; 'evalbus replay " +
                              run.string() + "' plays its finished episodes\n");
  }
  Program replay({"evalbus", "replay", run});
  // The monitor starts while the player is stopped, so that it does not start after the replay on a loaded
  // machine.
  std::vector<pid_t> player;
  ASSERT_TRUE(WaitFor([&] {
    player = ChildrenOf(replay.pid(), "lcm-logplayer");
    return !player.empty();
  })) << replay.err();
  std::optional<Stopped> stopped(player);
  Program monitor({"evalbus", "monitor", run});
  ASSERT_TRUE(WaitFor([&] { return monitor.out().starts_with("listening to "); })) << monitor.err();
  stopped.reset();
  ASSERT_TRUE(WaitFor([&] { return monitor.out().find("episode 0 ") != std::string::npos; }))
      << monitor.out() << monitor.err();
  EXPECT_EQ(replay.Wait(), 0) << replay.out() << replay.err();
  EXPECT_EQ(monitor.Wait(), 0);
  EXPECT_TRUE(monitor.out().ends_with("\nthe run has ended\n")) << monitor.out();
  ExpectNoComponentIsMissed(monitor.out());
}

TEST(MonitorRun, WrongInputIsOneLine) {
  TemporaryFolder folder;
  const std::vector<std::vector<std::string>> commands = {
      {"evalbus", "monitor", folder.path()},
      {"evalbus", "monitor", folder.path(), "--url", "udpm://239.255.76.67:7667"},
      {"evalbus-monitor", "--url", "tcp://here"}};
  for (const auto& command : commands) {
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 1) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_TRUE(result.err.starts_with("error: ")) << result.err;
  }
  fs::create_directories(folder.path() / "run");
  WriteText(folder.path() / "run/run.json", R"({"url": "", "in_process": true, "episodes": 3})");
  EXPECT_NE(RunProgram({"evalbus", "monitor", folder.path() / "run"}).err.find("in one process"),
            std::string::npos);
}

// A pseudo-terminal with a monitor in it.
class MonitorTerminal : public testing::Test {
 protected:
  void SetUp() override {
    EVALBUS_NEEDS_BUS();
    master_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    ASSERT_GE(master_, 0);
    ASSERT_EQ(grantpt(master_), 0);
    ASSERT_EQ(unlockpt(master_), 0);
    name_ = ptsname(master_);
    slave_ = open(name_.c_str(), O_RDWR | O_NOCTTY);
    ASSERT_EQ(tcgetattr(slave_, &before_), 0);
    const auto enter = [name = name_, own_session = own_session_] {
      own_session ? void(setsid()) : void(setpgid(0, 0));
      const int fd = open(name.c_str(), O_RDWR);
      dup2(fd, STDIN_FILENO);
      dup2(fd, STDOUT_FILENO);
    };
    monitor_.emplace(std::vector<std::string>{"evalbus-monitor", "--url", UniqueUrl()},
                     Program::Setting{"", enter});
    ASSERT_TRUE(WaitFor([&] { return Screen().find("\x1b[?1049h") != std::string::npos; }))
        << monitor_->err();
  }
  void TearDown() override {
    monitor_.reset();
    close(slave_);
    close(master_);
  }
  std::string Screen() {
    char buffer[4096];
    for (ssize_t n; (n = read(master_, buffer, sizeof buffer)) > 0;)
      screen_.append(buffer, static_cast<size_t>(n));
    return screen_;
  }
  void ExpectRestored() {
    const std::string screen = Screen();
    EXPECT_GT(screen.rfind("\x1b[?1049l") + 1, screen.rfind("\x1b[?1049h") + 1);
    EXPECT_GT(screen.rfind("\x1b[?25h") + 1, screen.rfind("\x1b[?25l") + 1);
    termios now{};
    ASSERT_EQ(tcgetattr(slave_, &now), 0);
    EXPECT_EQ(now.c_lflag, before_.c_lflag);
  }

  int master_ = -1, slave_ = -1;
  std::string name_, screen_;
  termios before_{};
  // True if the monitor has a separate terminal session, in which the terminal's keys raise signals.
  bool own_session_ = true;
  std::optional<Program> monitor_;
};

TEST_F(MonitorTerminal, IsLeftAsItWasByQ) {
  ASSERT_EQ(write(master_, "q", 1), 1);
  EXPECT_EQ(monitor_->Wait(), 0);
  ExpectRestored();
}

TEST_F(MonitorTerminal, IsLeftAsItWasByCtrlC) {
  ASSERT_EQ(write(master_, "\x03", 1), 1);
  EXPECT_EQ(monitor_->Wait(), 0);
  ExpectRestored();
}

TEST_F(MonitorTerminal, IsLeftAsItWasBySignals) {
  monitor_->Signal(SIGTERM);
  EXPECT_EQ(monitor_->Wait(), 0);
  ExpectRestored();
}

TEST_F(MonitorTerminal, IsLeftAsItWasByACrash) {
  monitor_->Signal(SIGSEGV);
  EXPECT_EQ(monitor_->Wait(), 128 + SIGSEGV);
  ExpectRestored();
}

// A process can be suspended only if its parent is in its session.
class SuspendedMonitor : public MonitorTerminal {
 protected:
  SuspendedMonitor() { own_session_ = false; }
};

TEST_F(SuspendedMonitor, LeavesTheTerminalAsItWas) {
  monitor_->Signal(SIGTSTP);
  EXPECT_TRUE(WaitFor([&] { return Screen().find("\x1b[?1049l") != std::string::npos; }));
  ExpectRestored();
  monitor_->Signal(SIGCONT);
  EXPECT_TRUE(WaitFor([&] { return Screen().rfind("\x1b[?1049h") > screen_.rfind("\x1b[?1049l"); }));
  monitor_->Signal(SIGINT);
  EXPECT_EQ(monitor_->Wait(), 0);
  ExpectRestored();
}

}  // namespace evalbus::monitor_run_test
