// The shell's PATH and library paths begin with a different compiler, tools and libraries, as conda, pyenv
// and environment modules set them.
#include <sys/stat.h>

#include <cstdlib>
#include <string>

#include "tests/integration/harness.h"

namespace evalbus::foreign_shell_test {

class ForeignShell : public testing::Test {
 protected:
  ForeignShell() {
    for (const char* folder : {"bin", "lib"}) std::filesystem::create_directories(folder_.path() / folder);
    for (const char* program : {"cmake", "ninja", "g++", "c++", "cc", "ld", "pkg-config", "pkgconf",
                                "python3", "ffmpeg", "lcm-gen"}) {
      WriteText(folder_.path() / "bin" / program, "#!/bin/sh\necho a foreign program >&2\nexit 99\n");
      chmod((folder_.path() / "bin" / program).c_str(), 0755);
    }
    for (const char* library : {"libstdc++.so.6", "libfmt.so.9", "libyaml-cpp.so.0.7", "libmujoco.so.2.2.2",
                                "liblcm.so.1", "libOSMesa.so.8", "libavcodec.so.59"}) {
      WriteText(folder_.path() / "lib" / library, "no library");
    }
  }
  Program::Setting Setting() const {
    const std::string bin = folder_.path() / "bin", lib = folder_.path() / "lib";
    return {.working_folder = folder_.path(), .before = [=] {
              setenv("PATH", (bin + ":" + getenv("PATH")).c_str(), 1);
              setenv("LD_LIBRARY_PATH", lib.c_str(), 1);
              setenv("CMAKE_PREFIX_PATH", lib.c_str(), 1);
              setenv("CXX", (bin + "/g++").c_str(), 1);
            }};
  }

  TemporaryFolder folder_;
};

TEST_F(ForeignShell, RunsAndVideos) {
  const Result result = RunProgram(
      {"evalbus", "run", "lift_pot", "--episodes", "1", "--video", "overview", "--out", "run"}, Setting());
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_GT(std::filesystem::file_size(folder_.path() / "run/episodes/0000/overview.mp4"), 1000u);
}

TEST_F(ForeignShell, BuildsWithDebiansTools) {
  const Result result = RunProgram(
      {"/bin/bash", "-c",
       ". " EVALBUS_SOURCE_DIR "/scripts/setup.sh && command -v cmake g++ ninja pkg-config python3 && "
       "echo \"${CXX-none} ${LD_LIBRARY_PATH-none} ${CMAKE_PREFIX_PATH-none}\""},
      Setting());
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out,
            "/usr/bin/cmake\n/usr/bin/g++\n/usr/bin/ninja\n/usr/bin/pkg-config\n/usr/bin/python3\nnone none "
            "none\n");
}

}  // namespace evalbus::foreign_shell_test
