// Tests the locations of episodes in a run folder.
#include "base/run_layout.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace evalbus::run_layout_test {

namespace fs = std::filesystem;

TEST(RunLayout, FoldersHaveTenThousandEpisodes) {
  EXPECT_EQ(EpisodeFolder("/r", 7), "/r/episodes/0007");
  EXPECT_EQ(EpisodeFolder("/r", 9'999), "/r/episodes/9999");
  EXPECT_EQ(EpisodeFolder("/r", 10'000), "/r/episodes/1xxxx/10000");
  EXPECT_EQ(EpisodeLog("/r", 123'456), "/r/episodes/12xxxx/123456/events.lcmlog");
  EXPECT_EQ(UnfinishedEpisodeFolder("/r", 10'001), "/r/episodes/1xxxx/10001.partial");
}

TEST(RunLayout, LogsKnowTheirRun) {
  for (const int episode : {0, 9'999, 10'000, 123'456})
    EXPECT_EQ(RunFolderOf(EpisodeLog("/a/r", episode)), "/a/r");
}

TEST(RunLayout, AllEpisodesAreFound) {
  const fs::path run = fs::path(testing::TempDir()) / "run_layout";
  fs::remove_all(run);
  EXPECT_TRUE(EpisodeFolders(run).empty());
  std::vector<fs::path> made = {EpisodeFolder(run, 3), EpisodeFolder(run, 10'000), EpisodeFolder(run, 20'001),
                                UnfinishedEpisodeFolder(run, 10'002)};
  for (const fs::path& folder : made) fs::create_directories(folder);
  fs::create_directories(run / "episodes/notes");
  std::vector<fs::path> found = EpisodeFolders(run);
  std::ranges::sort(found);
  std::ranges::sort(made);
  EXPECT_EQ(found, made);
  fs::remove_all(run);
}

}  // namespace evalbus::run_layout_test
