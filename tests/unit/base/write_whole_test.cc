#include "base/write_whole.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus {
namespace {

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

TEST(WriteWhole, WhatIsInTheWayIsAnInputErrorAndStays) {
  TemporaryFolder folder;
  for (const fs::path& file :
       {folder.path(), folder.path() / "no/such/folder", fs::path("/proc/version/a")}) {
    EXPECT_THROW(WriteWhole(file, "text"), InputError) << file;
  }
  EXPECT_EQ(NumFiles(folder.path()), 0u);
}

TEST(WriteWhole, AFullDiskLeavesWhatWasThere) {
  // /dev/full takes nothing; as a file of a folder it cannot be had, so the stream is enough.
  try {
    WriteWhole("/dev/full", "text");
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_STREQ(error.what(), "cannot write /dev/full: No space left on device");
  }
}

}  // namespace
}  // namespace evalbus
