// Several programs change files of a run at the same time. No change is lost.
#include <gmock/gmock.h>

#include <functional>
#include <thread>

#include "base/errors.h"
#include "base/run_layout.h"
#include "results/no_return.h"
#include "results/notes.h"
#include "results/run_folder.h"
#include "results/verdicts.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::run_files_lock_test {

constexpr int kWriters = 4, kEach = 10;

class RunFilesLockTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directory(run_ / kEpisodesFolder); }
  // Calls `write` for kWriters * kEach episodes, in kWriters threads. Threads suffice, because the lock
  // treats them like processes.
  static void WriteAtTheSameTime(const std::function<void(int writer, int episode)>& write) {
    std::vector<std::jthread> writers;
    for (int writer = 0; writer < kWriters; ++writer) {
      writers.emplace_back([&, writer] {
        for (int i = 0; i < kEach; ++i) write(writer, writer * kEach + i);
      });
    }
  }

  const TemporaryFolder folder_;
  const std::filesystem::path run_ = folder_.path();
};

TEST_F(RunFilesLockTest, KeepsTheNotesOfAllWriters) {
  WriteAtTheSameTime([&](int, int episode) { WriteNote(run_, episode, "note"); });
  EXPECT_THAT(ReadNotes(run_), testing::SizeIs(kWriters * kEach));
}

TEST_F(RunFilesLockTest, KeepsTheVerdictsOfAllOperators) {
  WriteAtTheSameTime([&](int writer, int episode) {
    WriteVerdict(run_, {.episode = episode, .operator_name = "operator " + std::to_string(writer)});
  });
  EXPECT_THAT(ReadVerdicts(run_), testing::SizeIs(kWriters * kEach));
}

TEST_F(RunFilesLockTest, KeepsThePointsOfNoReturnOfAllWriters) {
  WriteAtTheSameTime([&](int, int episode) { AddNoReturns(run_, {{episode, {}}}); });
  EXPECT_THAT(ReadNoReturns(run_), testing::SizeIs(kWriters * kEach));
}

TEST_F(RunFilesLockTest, AFolderWithoutEpisodesIsRefused) {
  std::filesystem::remove(run_ / kEpisodesFolder);
  EXPECT_THROW(RunFilesLock{run_}, InputError);
}

}  // namespace evalbus::results::run_files_lock_test
