// Tests that every output reports the actual control rate. It can differ from the requested rate, because a
// tick is a whole number of physics steps of 2 ms.
#include "bus/channels.h"
#include "evalbus/model_info_t.hpp"
#include "tests/integration/harness.h"

namespace evalbus::control_rate_test {

using nlohmann::ordered_json;

class ControlRate : public testing::Test {
 protected:
  Result Run(const std::string& hz, const std::string& name, int episodes = 2, bool resume = false) {
    std::vector<std::string> command = {
        "evalbus", "run",        ShortTask(folder_.path(), 0.1), "--in-process", "--control-hz",
        hz,        "--episodes", std::to_string(episodes),       "--out",        folder_.path() / name};
    if (resume) command.emplace_back("--resume");
    return RunProgram(command);
  }
  TemporaryFolder folder_;
};

TEST_F(ControlRate, IsTheRealOneEverywhere) {
  const Result result = Run("200", "run");
  ASSERT_EQ(result.code, 0) << result.err;
  const std::string line = "control rate: 250 Hz instead of 200 Hz; a tick is 2 physics steps of 2 ms\n";
  EXPECT_EQ(result.out.rfind(line, 0), 0u) << result.out;
  EXPECT_NE(result.out.find("lockstep 250 Hz"), std::string::npos) << result.out;
  const auto run = folder_.path() / "run";
  EXPECT_EQ(ordered_json::parse(ReadText(run / "run.json"))["control_hz"], 250);
  EXPECT_EQ(ReadLog(LogFile(run, 0)).Messages(channels::kModel).at(0).substeps, 2);

  // The run resumes with the original option value and with the same actual rate.
  EXPECT_EQ(Run("200", "run", 3, true).code, 0);
  EXPECT_EQ(Run("250", "run", 4, true).code, 0);
  EXPECT_EQ(Run("125", "run", 5, true).code, 1);
  EXPECT_EQ(Episodes(run).size(), 4u);
}

TEST_F(ControlRate, IsNotRemarkedIfItWasRequested) {
  for (const char* hz : {"50", "250", "500", "20"}) {
    const Result result = Run(hz, hz);
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_EQ(result.out.find("physics steps"), std::string::npos) << result.out;
  }
}

TEST_F(ControlRate, IsWhatComparesRuns) {
  for (const char* hz : {"200", "250", "167", "40", "41.7"}) ASSERT_EQ(Run(hz, hz).code, 0);
  const auto compare = [&](const std::string& a, const std::string& b) {
    return RunProgram({"evalbus", "compare", folder_.path() / a, folder_.path() / b});
  };
  EXPECT_EQ(compare("200", "250").code, 0) << compare("200", "250").err;
  EXPECT_EQ(compare("40", "41.7").code, 0) << compare("40", "41.7").err;
  const Result other = compare("200", "167");
  EXPECT_EQ(other.code, 1);
  EXPECT_NE(other.err.find("250 Hz"), std::string::npos) << other.err;
  EXPECT_NE(other.err.find("166.67 Hz"), std::string::npos) << other.err;
}

}  // namespace evalbus::control_rate_test
