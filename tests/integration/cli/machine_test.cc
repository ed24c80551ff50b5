// Tests faults of the machine: full and read-only disks, a wall clock that is set back, small receive
// buffers.
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "tests/integration/harness.h"

namespace evalbus::machine_test {

namespace fs = std::filesystem;

constexpr int kEpisodes = 3;

std::vector<std::string> RunCommand(const std::string& task, const fs::path& out,
                                    const std::vector<std::string>& more) {
  std::vector<std::string> command = {
      "evalbus", "run", task, "--policy", "random", "--episodes", std::to_string(kEpisodes), "--out", out};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

uintmax_t BytesIn(const fs::path& folder) {
  uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) bytes += fs::file_size(entry);
  }
  return bytes;
}

// Evaluates in one process and in several, on a separate disk that only this test and its children can
// access.
class Disk : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (!GetParam()) EVALBUS_NEEDS_BUS();
    if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        !Mount(0, 1 << 20)) {
      GTEST_SKIP() << "no file system of our own on this machine: " << std::strerror(errno);
    }
    ASSERT_EQ(RunProgram(RunCommand(task_, reference_, {"--in-process"})).code, 0);
  }
  void TearDown() override { umount(disk_.c_str()); }

  bool Mount(unsigned long flags, uintmax_t bytes) {
    fs::create_directory(disk_);
    const std::string size = "size=" + std::to_string(bytes);
    return mount("tmpfs", disk_.c_str(), "tmpfs", flags, size.c_str()) == 0;
  }
  Result Run(std::vector<std::string> more = {}) {
    if (GetParam()) more.push_back("--in-process");
    return RunProgram(RunCommand(task_, run_, more));
  }

  TemporaryFolder folder_;
  const std::string task_ = ShortTask(folder_.path(), 1);
  const fs::path reference_ = folder_.path() / "reference";
  const fs::path disk_ = folder_.path() / "disk";
  const fs::path run_ = disk_ / "run";
};

TEST_P(Disk, FullBeforeTheFirstEpisodeLeavesNothing) {
  ASSERT_TRUE(Mount(MS_REMOUNT, BytesIn(reference_ / "model") / 2));
  const Result result = Run();
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  const std::string expected = GetParam() ? "cannot write " + run_.string() + "/model/" : "o space left on";
  EXPECT_NE(result.err.find(expected), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(run_));
}

TEST_P(Disk, FullInMidRunKeepsWhatIsFinishedAndTheRestIsDoneLater) {
  const uintmax_t whole = BytesIn(reference_), models = BytesIn(reference_ / "model");
  // The disk has room for the first episode and a part of the second.
  ASSERT_TRUE(Mount(MS_REMOUNT, models + (whole - models) / 2 + (64 << 10)));
  const Result result = Run();
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find("o space left on"), std::string::npos) << result.err;
  const auto before = Episodes(run_);
  ASSERT_GE(before.size(), 1u);
  ASSERT_LT(before.size(), static_cast<size_t>(kEpisodes));
  EXPECT_EQ(before[0].dump(), Episodes(reference_)[0].dump());

  ASSERT_TRUE(Mount(MS_REMOUNT, 2 * whole));
  const Result resumed = Run({"--resume"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  ExpectSameScores(run_, reference_);
}

TEST_P(Disk, ReadOnlyIsRefused) {
  ASSERT_TRUE(Mount(MS_REMOUNT, 2 * BytesIn(reference_)));
  fs::copy(reference_, run_, fs::copy_options::recursive);
  ASSERT_TRUE(Mount(MS_REMOUNT | MS_RDONLY, 2 * BytesIn(reference_)));
  const Result resumed = Run({"--resume"});
  EXPECT_EQ(resumed.code, 2);
  EXPECT_EQ(std::count(resumed.err.begin(), resumed.err.end(), '\n'), 1) << resumed.err;
  EXPECT_NE(resumed.err.find("Read-only file system"), std::string::npos) << resumed.err;
  const Result fresh = RunProgram(RunCommand(task_, disk_ / "new", {"--in-process"}));
  EXPECT_EQ(fresh.code, 2);
  EXPECT_EQ(fresh.err,
            "error: --out " + (disk_ / "new").string() + ": cannot create: Read-only file system\n");
}

// The error is the last message in the worker's log, which is on the full disk.
TEST_P(Disk, FullWithWorkersIsNamed) {
  const uintmax_t whole = BytesIn(reference_), models = BytesIn(reference_ / "model");
  ASSERT_TRUE(Mount(MS_REMOUNT, models + (whole - models) / 2 + (64 << 10)));
  const Result result = Run({"--workers", "2"});
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find("o space left on"), std::string::npos) << result.err;
}

INSTANTIATE_TEST_SUITE_P(Hosting, Disk, testing::Bool(), [](const auto& test) {
  return std::string(test.param ? "InProcess" : "Processes");
});

TEST(Machine, AWallClockThatIsSetBackChangesNothing) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer must be the first library of a process";
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 1);
  const fs::path reference = folder.path() / "reference", run = folder.path() / "run",
                 realtime = folder.path() / "realtime";
  const Program::Setting setting{{}, [] { setenv("LD_PRELOAD", CLOCK_BACK, 1); }};
  // The preloaded clock works: a program that waits for half a second sees the time go back.
  ASSERT_EQ(
      RunProgram({"perl", "-e",
                  "$a = time; select(undef, undef, undef, 0.5); print($a - time > 7000 ? 'back' : 'on')"},
                 setting)
          .out,
      "back");
  ASSERT_EQ(RunProgram(RunCommand(task, reference, {"--in-process"})).code, 0);
  const Result result = RunProgram(RunCommand(task, run, {}), setting);
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out.find("retrying"), std::string::npos) << result.out;
  ExpectSameScores(run, reference);
  for (int i = 0; i < kEpisodes; ++i) {
    ExpectSameTicks(ReadLog(LogFile(run, i)), ReadLog(LogFile(reference, i)));
  }
  const Result paced = RunProgram(RunCommand(task, realtime, {"--realtime"}), setting);
  EXPECT_EQ(paced.code, 0) << paced.err;
  for (const auto& episode : Episodes(realtime)) EXPECT_EQ(episode["pacing"]["ticks"], 50);
}

// The component that lacks a resource reports it before liblcm fails for the same reason.
class Limit : public testing::Test {
 protected:
  Result Run(int resource, rlim_t limit, const std::vector<std::string>& more = {}) {
    return RunProgram(RunCommand(ShortTask(folder_.path(), 1), folder_.path() / "run", more),
                      {{}, [=] {
                         close_range(3, ~0U, 0);  // descriptors inherited from the test do not count
                         const rlimit both{limit, limit};
                         setrlimit(static_cast<__rlimit_resource>(resource), &both);
                       }});
  }
  static void ExpectOneLine(const Result& result, const std::string& words) {
    EXPECT_EQ(result.code, 2) << result.out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
  }

  TemporaryFolder folder_;
};

TEST_F(Limit, OfOpenFilesIsNamed) {
  EVALBUS_NEEDS_BUS();
  ExpectOneLine(Run(RLIMIT_NOFILE, 8), " files");
  // This limit is enough for a run's folder but not for a bus.
  ExpectOneLine(Run(RLIMIT_NOFILE, 13), ": too many open files; 'ulimit -n 256' is enough");
}

TEST_F(Limit, OfFileSizesIsNamed) {
  ExpectOneLine(Run(RLIMIT_FSIZE, 100'000, {"--in-process"}),
                "cannot write the compiled model physics.mjb: File too large");
  if (WhyNoBus().empty())
    ExpectOneLine(Run(RLIMIT_FSIZE, 100'000), "cannot write the compiled model physics.mjb: File too large");
}

TEST(Machine, TheKernelsDefaultReceiveBufferIsEnough) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 1);
  const fs::path reference = folder.path() / "reference", run = folder.path() / "run";
  ASSERT_EQ(RunProgram(RunCommand(task, reference, {"--in-process"})).code, 0);
  const Result result = RunProgram(RunCommand(task, run, {"--url", UniqueUrl() + "&recv_buf_size=212992"}));
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out.find("retrying"), std::string::npos) << result.out;
  ExpectSameScores(run, reference);
}

}  // namespace evalbus::machine_test
