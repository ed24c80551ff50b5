// Tests how evalbus web reads the logs of a run, also if one log cannot be opened, as on a file system that
// does not respond.
#include <signal.h>
#include <sys/stat.h>

#include <future>
#include <vector>

#include "base/run_layout.h"
#include "results/no_return.h"
#include "tests/integration/harness.h"
#include "tests/unit/viz/web/web_client.h"

namespace evalbus::web_logs_test {

namespace fs = std::filesystem;

class WebLogs : public testing::Test {
 protected:
  void SetUp() override {
    Evaluate({ShortTask(folder_.path(), 0.2), "--policy", "hold", "--episodes", "8", "--in-process"}, run_);
    server_.emplace(std::vector<std::string>{"evalbus", "web", run_, "--port", "0"});
    ASSERT_TRUE(WaitFor([&] { return server_->out().find("(Ctrl-C") != std::string::npos; }))
        << server_->err();
    const std::string said = server_->out();
    port_ = static_cast<uint16_t>(std::stoi(said.substr(said.find("127.0.0.1:") + 10)));
  }
  // Replaces this episode's log with a pipe that has no writer, so that opening it blocks.
  void MakeHang(int episode) {
    fs::remove(LogFile(run_, episode));
    ASSERT_EQ(mkfifo(LogFile(run_, episode).c_str(), 0600), 0);
  }
  std::string Ask(int episode) const { return viz::Get(port_, "/episode/0/" + std::to_string(episode)); }

  TemporaryFolder folder_;
  const fs::path run_ = folder_.path() / "run";
  std::optional<Program> server_;
  uint16_t port_ = 0;
};

TEST_F(WebLogs, OneThatHangsHoldsUpNoOtherAndNotTheEnd) {
  MakeHang(1);
  auto hanging = std::async(std::launch::async, [this] { return Ask(1); });
  for (const int episode : {0, 2, 3}) EXPECT_EQ(viz::StatusOf(Ask(episode)), 200) << episode;
  server_->Signal(SIGINT);
  EXPECT_EQ(server_->Wait(), 0) << server_->err();
  hanging.get();
}

// The page shows the points that `evalbus why` finds while the server is running.
TEST_F(WebLogs, APointOfNoReturnIsShownAfterItsEpisodeWasRead) {
  constexpr char kPoint[] = "Point of no return at 0.06 s";
  EXPECT_EQ(Ask(0).find(kPoint), std::string::npos);
  results::AddNoReturns(
      run_, {{0, {.kind = results::NoReturn::Kind::kLost, .tick = 3, .time_s = 0.06, .is_monotone = true}}});
  EXPECT_NE(Ask(0).find(kPoint), std::string::npos);
}

}  // namespace evalbus::web_logs_test
