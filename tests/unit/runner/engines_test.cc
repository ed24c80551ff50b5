#include "runner/engines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <fstream>

#include "base/errors.h"
#include "runner/processes.h"
#include "runner/run_options.h"

namespace evalbus::runner::engines_test {

// Creates empty programs next to this test program.
class EnginesTest : public testing::Test {
 protected:
  EnginesTest() {
    for (const char* version : {"9.3.9", "9.3.10", "9.4.0"}) std::ofstream(Program(version));
  }
  ~EnginesTest() override {
    for (const char* version : {"9.3.9", "9.3.10", "9.4.0"}) std::filesystem::remove(Program(version));
  }
  static std::filesystem::path Program(const std::string& version) {
    return Processes::BinaryFolder() / SimProgram(version);
  }
};

TEST_F(EnginesTest, TheNewestThatBeginsWithTheVersion) {
  EXPECT_EQ(FindEngine("9.3"), "9.3.10");
  EXPECT_EQ(FindEngine("9.3.9"), "9.3.9");
  EXPECT_EQ(FindEngine("9"), "9.4.0");
  try {
    FindEngine("9.3.1");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::StartsWith("--engine 9.3.1: not built; 'scripts/engine 9.3.1' builds "
                                                  "it; available: "));
    EXPECT_THAT(error.what(), testing::HasSubstr("9.3.9, 9.3.10, 9.4.0"));
    EXPECT_THAT(error.what(), testing::HasSubstr(std::string("available: ") + mj_versionString()));
  }
}

// A sim that was built for exactly evalbus' own version would be preferred.
TEST_F(EnginesTest, OurOwnMuJoCoHasNoSim) {
  const std::string own = mj_versionString();
  EXPECT_EQ(FindEngine(own.substr(0, own.rfind('.'))), "");
  EXPECT_EQ(EngineVersion(""), own);
  EXPECT_EQ(EngineVersion("9.3.9"), "9.3.9");
}

TEST(Engine, NeedsAProcess) {
  EXPECT_EQ(SimProgram(""), "evalbus-sim");
  RunOptions options;
  options.sim.engine = "3.3";
  options.in_process = true;
  EXPECT_THROW(CheckRunOptions(options, 1), InputError);
}

}  // namespace evalbus::runner::engines_test
