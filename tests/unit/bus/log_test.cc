#include "bus/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>

#include "base/errors.h"
#include "bus/bus.h"
#include "tests/unit/allocation_count.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::log_test {

using testing::ElementsAre;
using testing::MatchesRegex;

class LogTest : public testing::Test {
 protected:
  LogTest() {
    Log::SetFiles([this](const std::string& component) { return folder_.path() / (component + ".log"); });
    Log::SetLevel(LogLevel::kInfo);
    bus_.Subscribe(channels::kLog, [this](const log_t& line) { received_.push_back(line); });
  }
  ~LogTest() override {
    Log::SetFiles({});
    Log::SetLevel(LogLevel::kInfo);
  }

  std::vector<std::string> Lines(const std::string& component) {
    std::ifstream stream(folder_.path() / (component + ".log"));
    std::vector<std::string> lines;
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
  }
  std::vector<std::string> Received() {
    while (bus_.Handle()) {
    }
    std::vector<std::string> texts;
    for (const log_t& line : received_) texts.push_back(line.text);
    return texts;
  }
  // Repeats the case if it took longer than a second, because at most ten lines are published per second.
  template <class Write>
  void WithinASecond(const Write& write) {
    while (true) {
      const auto start = std::chrono::steady_clock::now();
      std::filesystem::remove(folder_.path() / "sim.log");
      Received();
      received_.clear();
      write();
      if (std::chrono::steady_clock::now() - start < std::chrono::seconds(1)) return;
    }
  }

  TemporaryFolder folder_;
  Bus bus_{"memq://"};
  std::vector<log_t> received_;
};

TEST_F(LogTest, LinesHaveTimeLevelComponentAndPlace) {
  Log log("sim", &bus_);
  log.Info("starts");
  log.SetPlace({0, 3, 0, -1, 0});
  log.Warn("{} of {}", 1, 2);
  log.SetPlace({0, 3, 1, 127, 2540000});
  log.Error("falls");
  const std::string time = "[0-9]{4}-[0-9]{2}-[0-9]{2} [0-9:]{8}\\.[0-9]{3} ";
  EXPECT_THAT(Lines("sim"), ElementsAre(MatchesRegex(time + "\\[info\\] sim  starts"),
                                        MatchesRegex(time + "\\[warning\\] sim  e3  1 of 2"),
                                        MatchesRegex(time + "\\[error\\] sim  e3 attempt 2 t127  falls")));
  EXPECT_THAT(Received(), ElementsAre("starts", "1 of 2", "falls"));
  EXPECT_EQ(received_[2].component, "sim");
  EXPECT_EQ(received_[2].level, log_t::ERROR_LEVEL);
  EXPECT_EQ(received_[2].header.tick, 127);
  EXPECT_EQ(received_[2].header.attempt, 1);
}

TEST_F(LogTest, OneFileForEachComponent) {
  Log sim("sim", &bus_), policy("policy", &bus_);
  sim.Info("a");
  policy.Info("b");
  EXPECT_EQ(Lines("sim").size(), 1u);
  EXPECT_EQ(Lines("policy").size(), 1u);
}

TEST_F(LogTest, DebugIsForTheFileAlone) {
  Log::SetLevel(LogLevel::kDebug);
  Log log("sim", &bus_);
  log.Debug("detail");
  EXPECT_EQ(Lines("sim").size(), 1u);
  EXPECT_THAT(Received(), ElementsAre());
}

TEST_F(LogTest, ALevelThatIsOffCostsNothing) {
  Log::SetLevel(LogLevel::kWarn);
  Log log("sim", &bus_);
  const int64_t before = AllocatedBytes();
  for (int i = 0; i < 1000; ++i) log.Info("{} {}", i, 0.5);
  EXPECT_EQ(AllocatedBytes(), before);
  EXPECT_TRUE(Lines("sim").empty());
}

TEST_F(LogTest, TheBusReceivesTenLinesASecondAndTheNumberOfTheRest) {
  std::optional<Log> log;
  WithinASecond([&] {
    log.emplace("sim", &bus_);
    for (int i = 0; i < 47; ++i) log->Info("line {}", i);
    log->Poll(std::chrono::steady_clock::now());
  });
  EXPECT_EQ(Lines("sim").size(), 47u);
  EXPECT_EQ(Received().size(), 10u);
  log->Poll(std::chrono::steady_clock::now() + std::chrono::seconds(2));
  ASSERT_EQ(Received().size(), 11u);
  EXPECT_EQ(Received().back(), "37 more lines suppressed");
}

TEST_F(LogTest, ControlCharactersAreMadeHarmless) {
  Log log("sim", &bus_);
  log.Info("{}", "two\nlines \x1b[2J");
  EXPECT_THAT(Received(), ElementsAre("two?lines ?[2J"));
  EXPECT_EQ(Lines("sim").size(), 1u);
}

// A subscriber that logs a line for each received line loops, but only as fast as the rate limit allows.
TEST_F(LogTest, LinesAboutLinesAreBounded) {
  std::optional<Log> log;
  bus_.Subscribe(channels::kLog, [&](const log_t& line) {
    if (log) log->Info("received {}", line.text.size());
  });
  WithinASecond([&] {
    log.reset();
    Received();
    received_.clear();
    log.emplace("sim", &bus_);
    log->Info("first");
    Received();
  });
  EXPECT_EQ(received_.size(), 10u);
}

TEST_F(LogTest, AFileThatCannotBeWrittenIsReported) {
  Log::SetFiles([](const std::string&) { return "/proc/none/sim.log"; });
  EXPECT_THROW(Log("sim", &bus_), EnvironmentError);
}

TEST(LogLevels, AreWords) {
  EXPECT_EQ(ParseLogLevel("debug"), LogLevel::kDebug);
  EXPECT_EQ(ParseLogLevel("off"), LogLevel::kOff);
  EXPECT_THROW(ParseLogLevel("loud"), InputError);
}

}  // namespace evalbus::log_test
