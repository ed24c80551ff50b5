#include "models/mujoco_errors.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <thread>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::mujoco_errors_test {

template <class Error>
std::string Thrown(const char* message) {
  try {
    mju_error(message);
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing";
}

// Collects warnings as the log sink receives them.
class MujocoErrors : public testing::Test {
 protected:
  MujocoErrors() {
    InstallMujocoHandlers();
    SetMujocoWarningSink([this](const std::string& warning) { received_.push_back(warning); });
  }
  ~MujocoErrors() override { SetMujocoWarningSink({}); }

  std::vector<std::string> received_;
};

TEST_F(MujocoErrors, ErrorsOfARunAreOfTheEnvironmentAndWarningsGoToTheSink) {
  EXPECT_EQ(Thrown<EnvironmentError>("stack overflow"), "MuJoCo: stack overflow");
  mju_warning("unstable");
  EXPECT_EQ(received_, std::vector<std::string>{"unstable"});
}

TEST_F(MujocoErrors, WithoutASinkWarningsAreLinesOnStderr) {
  SetMujocoWarningSink({});
  testing::internal::CaptureStderr();
  mju_warning("unstable");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "MuJoCo warning: unstable\n");
  EXPECT_TRUE(received_.empty());
}

// Without evalbus' handlers, MuJoCo writes MUJOCO_LOG.TXT into the user's current folder.
TEST_F(MujocoErrors, NoFileIsLeft) {
  TemporaryFolder folder;
  const std::filesystem::path back = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  mju_warning("unstable");
  Thrown<EnvironmentError>("stack overflow");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  std::filesystem::current_path(back);
}

TEST_F(MujocoErrors, ASinkMaySetAnother) {
  SetMujocoWarningSink([this](const std::string&) {
    SetMujocoWarningSink([this](const std::string& warning) { received_.push_back("later " + warning); });
  });
  mju_warning("one");
  mju_warning("two");
  EXPECT_EQ(received_, std::vector<std::string>{"later two"});
}

TEST_F(MujocoErrors, ErrorsOfTheModelCompilerAreInputErrors) {
  std::vector<std::string> warnings;
  {
    const MujocoCompileGuard guard(&warnings);
    mju_warning("two hulls");
    EXPECT_EQ(Thrown<InputError>("bad mesh"), "MuJoCo: bad mesh");
    // Another thread is executing a run.
    std::thread([] {
      mju_warning("unstable");
      EXPECT_EQ(Thrown<EnvironmentError>("stack overflow"), "MuJoCo: stack overflow");
    }).join();
  }
  EXPECT_EQ(warnings, std::vector<std::string>{"MuJoCo: two hulls"});
  EXPECT_EQ(received_, std::vector<std::string>{"unstable"});
  EXPECT_EQ(Thrown<EnvironmentError>("stack overflow"), "MuJoCo: stack overflow");
}

TEST_F(MujocoErrors, OneCompilerAtATime) {
  std::atomic<int> compiling = 0, most = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < 200; ++k) {
        std::vector<std::string> warnings;
        const MujocoCompileGuard guard(&warnings);
        most = std::max(most.load(), ++compiling);
        std::this_thread::yield();
        mju_warning("mine");
        EXPECT_EQ(warnings.size(), 1u);
        --compiling;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(most, 1);
  EXPECT_TRUE(received_.empty());
}

}  // namespace evalbus::mujoco_errors_test
