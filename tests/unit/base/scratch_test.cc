#include "base/scratch.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <memory>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

// Starts a process that holds a temporary folder in TMPDIR.
pid_t Holder() {
  int ready[2];
  if (pipe(ready) != 0) return -1;
  const pid_t pid = fork();
  if (pid == 0) {
    const Scratch scratch;
    std::ofstream(scratch.path() / "log") << "data";
    if (write(ready[1], "x", 1) == 1) pause();
    _exit(1);
  }
  char byte = 0;
  EXPECT_EQ(read(ready[0], &byte, 1), 1);
  close(ready[0]);
  close(ready[1]);
  return pid;
}

void Kill(pid_t pid) {
  kill(pid, SIGKILL);
  waitpid(pid, nullptr, 0);
}

size_t Entries(const fs::path& folder) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST(ScratchTest, OfKilledProcessesAreRemovedAndNoOthers) {
  const TemporaryFolder folder;
  const char* const before = getenv("TMPDIR");
  const std::string old = before ? before : "";
  setenv("TMPDIR", folder.path().c_str(), 1);
  const pid_t killed = Holder(), alive = Holder();
  auto own = std::make_unique<Scratch>();
  before ? setenv("TMPDIR", old.c_str(), 1) : unsetenv("TMPDIR");
  // These are two folders of users and a folder of a version that did not lock its folder.
  for (const char* const name : {"evalbus-x", "evalbus-results-2026", "evalbus-Ab3dEf"}) {
    fs::create_directory(folder.path() / name);
  }
  ASSERT_EQ(Entries(folder.path()), 6u);
  RemoveAbandonedScratch(folder.path());
  EXPECT_EQ(Entries(folder.path()), 6u);
  Kill(killed);
  RemoveAbandonedScratch(folder.path());
  EXPECT_EQ(Entries(folder.path()), 5u);
  EXPECT_TRUE(fs::exists(own->path()));
  own.reset();
  EXPECT_EQ(Entries(folder.path()), 4u);
  Kill(alive);
  RemoveAbandonedScratch(folder.path());
  EXPECT_EQ(Entries(folder.path()), 3u);
}

TEST(ScratchTest, NamesTheVariableOfAMissingFolder) {
  const char* const before = getenv("TMPDIR");
  const std::string kept = before ? before : "";
  setenv("TMPDIR", "/nonexistent", 1);
  try {
    const Scratch scratch;
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("(TMPDIR): /nonexistent: "), std::string::npos) << error.what();
  }
  if (before) {
    setenv("TMPDIR", kept.c_str(), 1);
  } else {
    unsetenv("TMPDIR");
  }
}

TEST(ScratchTest, ALockedOneIsInUseWhateverItsProcess) {
  const TemporaryFolder folder;
  const pid_t ended = fork();
  if (ended == 0) _exit(0);
  waitpid(ended, nullptr, 0);
  char host[256] = {};
  ASSERT_EQ(gethostname(host, sizeof host - 1), 0);
  const fs::path abandoned =
      folder.path() / ("evalbus-" + std::string(host) + "-" + std::to_string(ended) + "-Ab3dEf");
  fs::create_directory(abandoned);
  const int fd = open(abandoned.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  struct flock lock {};
  lock.l_type = F_RDLCK;
  ASSERT_EQ(fcntl(fd, F_OFD_SETLK, &lock), 0);
  RemoveAbandonedScratch(folder.path());
  EXPECT_TRUE(fs::exists(abandoned));
  close(fd);
  RemoveAbandonedScratch(folder.path());
  EXPECT_FALSE(fs::exists(abandoned));
}

}  // namespace
}  // namespace evalbus
