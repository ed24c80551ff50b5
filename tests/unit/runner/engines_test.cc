#include "runner/engines.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <fstream>

#include "base/errors.h"
#include "runner/run_options.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::runner::engines_test {

namespace fs = std::filesystem;

// The programs lie in a folder of the test, because other tests read the folder of this program.
TEST(Engines, TheNewestThatBeginsWithTheVersion) {
  const TemporaryFolder folder;
  for (const char* version : {"9.3.9", "9.3.10", "9.4.0"}) {
    std::ofstream(fs::path(folder.path()) / SimProgram(version));
  }
  const auto find = [&](const std::string& wanted) { return FindEngine(wanted, "--engine", folder.path()); };
  EXPECT_EQ(find("9.3"), "9.3.10");
  EXPECT_EQ(find("9.3.9"), "9.3.9");
  EXPECT_EQ(find("9"), "9.4.0");
  try {
    find("9.3.1");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(), "--engine 9.3.1: not built; 'scripts/engine 9.3.1' builds it; available: " +
                                std::string(mj_versionString()) + ", 9.3.9, 9.3.10, 9.4.0");
  }
}

// A sim that was built for exactly evalbus' own version would be preferred.
TEST(Engines, OurOwnMuJoCoHasNoSim) {
  const std::string own = mj_versionString();
  EXPECT_EQ(FindEngine(own.substr(0, own.rfind('.'))), "");
  EXPECT_EQ(EngineVersion(""), own);
  EXPECT_EQ(EngineVersion("9.3.9"), "9.3.9");
}

TEST(Engines, NeedAProcess) {
  EXPECT_EQ(SimProgram(""), "evalbus-sim");
  RunOptions options;
  options.sim.engine = "3.3";
  options.in_process = true;
  EXPECT_THROW(CheckRunOptions(options, 1), InputError);
}

}  // namespace evalbus::runner::engines_test
