#include "base/write_whole.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "base/errors.h"
#include "base/this_process.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::write_whole_test {

namespace fs = std::filesystem;

std::string Text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

size_t NumFiles(const fs::path& folder) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST(WriteWhole, CreatesAndReplaces) {
  TemporaryFolder folder;
  WriteWhole(folder.path() / "a", "one");
  EXPECT_EQ(Text(folder.path() / "a"), "one");
  WriteWhole(folder.path() / "a", "");
  EXPECT_EQ(Text(folder.path() / "a"), "");
  EXPECT_EQ(NumFiles(folder.path()), 1u);
}

TEST(WriteWhole, KeepsPermissions) {
  TemporaryFolder folder;
  const fs::path file = folder.path() / "a";
  WriteWhole(file, "one");
  ASSERT_EQ(chmod(file.c_str(), 0640), 0);
  WriteWhole(file, "two");
  EXPECT_EQ(fs::status(file).permissions(), fs::perms(0640));
}

TEST(WriteWhole, FollowsLinks) {
  TemporaryFolder folder;
  fs::create_directory(folder.path() / "there");
  fs::create_symlink("there/a", folder.path() / "link");
  for (const std::string text : {"one", "two"}) {
    WriteWhole(folder.path() / "link", text);
    EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
    EXPECT_EQ(Text(folder.path() / "there/a"), text);
  }
  EXPECT_EQ(NumFiles(folder.path() / "there"), 1u);
}

TEST(WriteWhole, WritesToAPipeAsItIs) {
  TemporaryFolder folder;
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  WriteWhole("/proc/self/fd/" + std::to_string(ends[1]), "through");
  char text[7];
  EXPECT_EQ(read(ends[0], text, sizeof text), 7);
  EXPECT_EQ(std::string(text, 7), "through");
  close(ends[0]);
  close(ends[1]);
  WriteWhole("/dev/null", "gone");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(WriteWhole, WritesThroughADeviceAndANamedPipe) {
  TemporaryFolder folder;
  const fs::path fifo = folder.path() / "fifo", device = folder.path() / "null";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  const int reader = open(fifo.c_str(), O_RDWR);
  WriteWhole(fifo, "through");
  char text[7];
  EXPECT_EQ(read(reader, text, sizeof text), 7);
  EXPECT_EQ(std::string(text, 7), "through");
  EXPECT_TRUE(fs::is_fifo(fifo));
  close(reader);
  if (mknod(device.c_str(), S_IFCHR | 0600, makedev(1, 3)) ==
      0) {  // needs root, and fails in some containers
    fs::create_symlink("null", folder.path() / "link");
    for (const char* name : {"null", "link"}) WriteWhole(folder.path() / name, "gone");
    EXPECT_TRUE(fs::is_character_file(device));
    EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
  }
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    EXPECT_FALSE(ParseTemporaryName(entry.path().filename())) << entry.path();
  }
}

// The file is opened like with a shell's `>> file`.
TEST(WriteWhole, WritesBehindWhatAnOpenFileHas) {
  TemporaryFolder folder;
  const fs::path file = folder.path() / "a";
  WriteWhole(file, "one ");
  const int fd = open(file.c_str(), O_WRONLY | O_APPEND);
  for (const char* of : {"/proc/self/fd/", "/dev/fd/"}) WriteWhole(of + std::to_string(fd), "two ");
  fs::create_symlink("/proc/self/fd/" + std::to_string(fd), folder.path() / "link");
  WriteWhole(folder.path() / "link", "three");
  EXPECT_EQ(write(fd, ".", 1), 1);
  close(fd);
  EXPECT_EQ(Text(file), "one two two three.");
}

TEST(WriteWhole, KeepsTheOwner) {
  if (geteuid() != 0) GTEST_SKIP() << "only root gives files away";
  TemporaryFolder folder;
  WriteWhole(folder.path() / "a", "one");
  ASSERT_EQ(chown((folder.path() / "a").c_str(), 1234, 4321), 0);
  WriteWhole(folder.path() / "a", "two");
  struct stat after {};
  ASSERT_EQ(stat((folder.path() / "a").c_str(), &after), 0);
  EXPECT_EQ(after.st_uid, 1234u);
  EXPECT_EQ(after.st_gid, 4321u);
}

TEST(WriteWhole, KnowsItsTemporaryNames) {
  const auto parsed = ParseTemporaryName("a.json.12.tmp");
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->file, "a.json");
  EXPECT_EQ(parsed->process, "12");
  EXPECT_EQ(parsed->pid, 12);
  const auto of_a_host = ParseTemporaryName("a.json.node7_my-lab-4711.tmp");
  ASSERT_TRUE(of_a_host);
  EXPECT_EQ(of_a_host->file, "a.json");
  EXPECT_EQ(of_a_host->process, "node7.my-lab-4711");
  EXPECT_EQ(of_a_host->pid, 4711);
  for (const char* name : {"a.json", "a.json.tmp", "a.json..tmp", "a.json.1x.tmp", "a.json.-1.tmp", ".tmp",
                           "12.tmp", "a.json.12.tmp2", "a.json.node7-.tmp", "a.json.node7.tmp"}) {
    EXPECT_FALSE(ParseTemporaryName(name)) << name;
  }
}

// Two machines that write the same file on a shared disk may have processes with equal ids.
TEST(WriteWhole, ATemporaryNameContainsMachineAndProcess) {
  TemporaryFolder folder;
  const fs::path file = folder.path() / "a.json";
  WriteWhole(file, "before");
  // A child process that exceeds the file size limit is killed and leaves its temporary file.
  const pid_t child = fork();
  if (child == 0) {
    const struct rlimit limit = {10, 10};
    setrlimit(RLIMIT_FSIZE, &limit);
    WriteWhole(file, std::string(100, 'x'));
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  std::string left;
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    if (entry.path() != file) left = entry.path().filename();
  }
  const auto parsed = ParseTemporaryName(left);
  ASSERT_TRUE(parsed) << left;
  EXPECT_EQ(parsed->file, "a.json");
  EXPECT_EQ(parsed->pid, child);
  EXPECT_TRUE(HasEnded(parsed->process)) << parsed->process;
  EXPECT_EQ(Text(file), "before");
}

TEST(ThisProcess, OnlyProcessesOfThisMachineAreReportedAsEnded) {
  const std::string self = ThisProcess();
  EXPECT_FALSE(HasEnded(self));
  const pid_t child = fork();
  if (child == 0) _exit(0);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  const std::string host = self.substr(0, self.rfind('-'));
  EXPECT_TRUE(HasEnded(host + "-" + std::to_string(child)));
  for (const std::string& name : {"other-" + std::to_string(child), std::to_string(child), host, host + "-",
                                  host + "-1x", host + "--5", std::string()}) {
    EXPECT_FALSE(HasEnded(name)) << name;
  }
}

TEST(WriteWhole, WhatIsInTheWayIsAnInputErrorAndStays) {
  TemporaryFolder folder;
  fs::create_symlink("loop", folder.path() / "loop");
  for (const fs::path& file : {folder.path(), folder.path() / "no/such/folder", fs::path("/proc/version/a"),
                               fs::path(), folder.path() / std::string(300, 'x'), folder.path() / "loop"}) {
    EXPECT_THROW(WriteWhole(file, "text"), InputError) << file;
  }
  EXPECT_EQ(NumFiles(folder.path()), 1u);
}

TEST(WriteWhole, AFullDiskLeavesWhatWasThere) {
  // /dev/full refuses every write. It cannot be a file in the test's folder, so only the stream is tested.
  try {
    WriteWhole("/dev/full", "text");
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_STREQ(error.what(), "cannot write /dev/full: No space left on device");
  }
}

}  // namespace evalbus::write_whole_test
