#include "base/installed.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "base/find_program.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::installed_test {

namespace fs = std::filesystem;

TEST(Installed, DataBesideTheProgramComesFirst) {
  const std::string name = "of_installed_test";
  EXPECT_EQ(SharedData(name, "/otherwise"), "/otherwise");
  // The test programs are in build/bin, so the shared folder is next to it, in build/share.
  const fs::path shared = fs::path(EVALBUS_BINARY_DIR) / "share/evalbus" / name;
  fs::create_directories(shared);
  EXPECT_EQ(SharedData(name, "/otherwise"), shared);
  fs::remove(shared);
}

class FindProgramTest : public testing::Test {
 protected:
  FindProgramTest() { setenv("EVALBUS_PATH", folder_.path().c_str(), 1); }
  ~FindProgramTest() override {
    unsetenv("EVALBUS_PATH");
    unsetenv("EVALBUS_FFMPEG");
  }

  fs::path MakeProgram(const std::string& name) const {
    const fs::path program = folder_.path() / name;
    std::ofstream(program) << "#!/bin/sh\n";
    fs::permissions(program, fs::perms::owner_all);
    return program;
  }

  const TemporaryFolder folder_;
};

TEST_F(FindProgramTest, LooksBesideThisProgramLast) {
  EXPECT_EQ(FindProgram("no_such_program"), "");
  EXPECT_EQ(FindProgram("base_test"), fs::path(EVALBUS_BINARY_DIR) / "bin/base_test");
  const fs::path first = MakeProgram("base_test");
  EXPECT_EQ(FindProgram("base_test"), first);
}

TEST_F(FindProgramTest, UsesTheNamedFfmpegIfThereIsNoOther) {
  EXPECT_EQ(FindFfmpeg(), "");
  setenv("EVALBUS_FFMPEG", (folder_.path() / "missing").c_str(), 1);
  EXPECT_EQ(FindFfmpeg(), "");
  const fs::path named = MakeProgram("ffmpeg-linux-x86_64-v7.0.2");
  setenv("EVALBUS_FFMPEG", named.c_str(), 1);
  EXPECT_EQ(FindFfmpeg(), named);
  const fs::path own = MakeProgram("ffmpeg");
  EXPECT_EQ(FindFfmpeg(), own);
}

}  // namespace evalbus::installed_test
