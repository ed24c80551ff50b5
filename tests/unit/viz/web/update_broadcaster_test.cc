// Tests which viewer receives which blocks. Blocks are plain text here, except for blocks that the
// broadcaster creates.
#include "viz/web/update_broadcaster.h"

#include <gmock/gmock.h>

#include "viz/viewer/block.h"

namespace evalbus::viz::update_broadcaster_test {

using testing::ElementsAre;

std::vector<std::string> TakeAll(UpdateBroadcaster* broadcaster, UpdateBroadcaster::Viewer* viewer) {
  std::vector<std::string> blocks;
  while (const SharedBytes block = broadcaster->Next(viewer)) blocks.push_back(*block);
  return blocks;
}

nlohmann::ordered_json Head(const std::string& block) { return BlockReader(block).head(); }

std::vector<EpisodeRow> Rows(const std::vector<int>& episodes) {
  std::vector<EpisodeRow> rows;
  for (const int episode : episodes) rows.emplace_back().episode = episode;
  return rows;
}

TEST(UpdateBroadcaster, AViewerReceivesTheNewestStateOnly) {
  UpdateBroadcaster broadcaster;
  UpdateBroadcaster::Viewer viewer;
  broadcaster.Enter(&viewer);
  broadcaster.SetRun(0, "a");
  broadcaster.SetRun(0, "b");
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre("b"));
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre());
  broadcaster.SetRun(0, "c");
  broadcaster.SetRun(1, "other");
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre("c", "other"));
}

TEST(UpdateBroadcaster, AViewerThatConnectsMidEpisodeReceivesAllOfItThenTicks) {
  UpdateBroadcaster broadcaster;
  UpdateBroadcaster::Viewer viewer;
  broadcaster.Enter(&viewer);
  EXPECT_TRUE(broadcaster.is_watched(0));
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre());
  EXPECT_TRUE(broadcaster.needs_episode(0));
  broadcaster.SetEpisode(0, "episode to 10", true);
  broadcaster.AddTicks(0, "10 to 12");
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre("episode to 10", "10 to 12"));
  EXPECT_FALSE(broadcaster.needs_episode(0));
  // The next viewer receives the existing blocks.
  UpdateBroadcaster::Viewer late;
  broadcaster.Enter(&late);
  EXPECT_THAT(TakeAll(&broadcaster, &late), ElementsAre("episode to 10", "10 to 12"));
  broadcaster.AddTicks(0, "12 to 14");
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre("12 to 14"));
  EXPECT_THAT(TakeAll(&broadcaster, &late), ElementsAre("12 to 14"));
}

TEST(UpdateBroadcaster, WhoDoesNotReadLosesTicksAndIsGivenTheWholeEpisodeAgain) {
  UpdateBroadcaster broadcaster;
  UpdateBroadcaster::Viewer slow, quick;
  broadcaster.Enter(&slow);
  broadcaster.Enter(&quick);
  broadcaster.SetEpisode(0, "episode", true);
  TakeAll(&broadcaster, &slow);
  TakeAll(&broadcaster, &quick);
  for (size_t i = 0; i <= UpdateBroadcaster::kKeptTicks; ++i) {
    broadcaster.AddTicks(0, "ticks");
    EXPECT_THAT(TakeAll(&broadcaster, &quick), ElementsAre("ticks"));
  }
  EXPECT_FALSE(broadcaster.needs_episode(0));
  EXPECT_THAT(TakeAll(&broadcaster, &slow), ElementsAre());
  EXPECT_TRUE(broadcaster.needs_episode(0));
  broadcaster.SetEpisode(0, "episode now", false);
  EXPECT_THAT(TakeAll(&broadcaster, &slow), ElementsAre("episode now"));
  // A viewer that has all blocks receives nothing.
  EXPECT_THAT(TakeAll(&broadcaster, &quick), ElementsAre());
  broadcaster.AddTicks(0, "further");
  EXPECT_THAT(TakeAll(&broadcaster, &slow), ElementsAre("further"));
  EXPECT_THAT(TakeAll(&broadcaster, &quick), ElementsAre("further"));
}

TEST(UpdateBroadcaster, ManyBytesOfTicksAreNotKept) {
  UpdateBroadcaster broadcaster;
  UpdateBroadcaster::Viewer viewer;
  broadcaster.Enter(&viewer);
  broadcaster.SetEpisode(0, "episode", true);
  TakeAll(&broadcaster, &viewer);
  for (int i = 0; i < 3; ++i)
    broadcaster.AddTicks(0, std::string(UpdateBroadcaster::kKeptTickBytes / 2, 'x'));
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre());
  EXPECT_TRUE(broadcaster.needs_episode(0));
}

TEST(UpdateBroadcaster, ANewEpisodeIsSentToEveryViewer) {
  UpdateBroadcaster broadcaster;
  UpdateBroadcaster::Viewer viewer, behind;
  broadcaster.Enter(&viewer);
  broadcaster.Enter(&behind);
  broadcaster.SetEpisode(0, "episode 0", true);
  broadcaster.AddTicks(0, "ticks of 0");
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre("episode 0", "ticks of 0"));
  EXPECT_EQ(*broadcaster.Next(&behind), "episode 0");
  broadcaster.SetEpisode(0, "episode 1", true);
  broadcaster.AddTicks(0, "ticks of 1");
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre("episode 1", "ticks of 1"));
  EXPECT_THAT(TakeAll(&broadcaster, &behind), ElementsAre("episode 1", "ticks of 1"));
}

TEST(UpdateBroadcaster, WatchingAnotherRunBringsItsEpisode) {
  UpdateBroadcaster broadcaster;
  UpdateBroadcaster::Viewer viewer;
  broadcaster.Enter(&viewer);
  EXPECT_FALSE(broadcaster.Watch(&viewer, 1));
  broadcaster.SetRun(1, "run 1");
  broadcaster.SetEpisode(1, "episode of 1", true);
  broadcaster.SetEpisode(0, "episode of 0", true);
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre("run 1", "episode of 0"));
  EXPECT_TRUE(broadcaster.Watch(&viewer, 1));
  EXPECT_FALSE(broadcaster.is_watched(0));
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre("episode of 1"));
  broadcaster.AddTicks(0, "unwatched");
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre());
  broadcaster.Leave(&viewer);
  EXPECT_FALSE(broadcaster.is_watched(1));
  EXPECT_EQ(broadcaster.num_viewers(), 0);
}

TEST(UpdateBroadcaster, LeavingDoesNotWait) {
  UpdateBroadcaster broadcaster;
  UpdateBroadcaster::Viewer viewer;
  broadcaster.Enter(&viewer);
  TakeAll(&broadcaster, &viewer);
  EXPECT_TRUE(broadcaster.needs_episode(0));
  broadcaster.Leave(&viewer);
  EXPECT_FALSE(broadcaster.needs_episode(0));
}

TEST(UpdateBroadcaster, AListComesInPiecesAndThenWhatIsAdded) {
  UpdateBroadcaster broadcaster;
  std::vector<EpisodeRow> episodes(33'000);
  for (int i = 0; i < 33'000; ++i) episodes[static_cast<size_t>(i)].episode = i;
  broadcaster.SetEpisodes(0, 0, episodes);
  UpdateBroadcaster::Viewer viewer;
  broadcaster.Enter(&viewer);
  int next = 0;
  size_t blocks = 0;
  for (; const SharedBytes block = broadcaster.Next(&viewer); ++blocks) {
    const auto head = Head(*block);
    EXPECT_EQ(head["block"], "episodes");
    EXPECT_EQ(head["run"], 0);
    EXPECT_EQ(head["from"], next);
    for (const auto& episode : head["episodes"]) ASSERT_EQ(episode["episode"], next++);
  }
  EXPECT_EQ(next, 33'000);
  EXPECT_EQ(blocks, 33u);
  broadcaster.SetEpisodes(0, 33'000, Rows({33'000}));
  const auto added = TakeAll(&broadcaster, &viewer);
  ASSERT_EQ(added.size(), 1u);
  EXPECT_EQ(Head(added[0])["from"], 33'000);
  EXPECT_EQ(Head(added[0])["episodes"].size(), 1u);
  // If a list was replaced (a resumed run), it is sent from its beginning.
  broadcaster.SetEpisodes(0, 2, Rows({7}));
  const auto anew = TakeAll(&broadcaster, &viewer);
  ASSERT_EQ(anew.size(), 1u);
  EXPECT_EQ(Head(anew[0])["from"], 0);
  EXPECT_EQ(Head(anew[0])["episodes"].size(), 3u);
  // If it has become empty, because the run was removed, this is also sent, but not to the next viewer.
  broadcaster.SetEpisodes(0, 0, {});
  const auto none = TakeAll(&broadcaster, &viewer);
  ASSERT_EQ(none.size(), 1u);
  EXPECT_EQ(Head(none[0])["from"], 0);
  EXPECT_EQ(Head(none[0])["episodes"].size(), 0u);
  UpdateBroadcaster::Viewer late;
  broadcaster.Enter(&late);
  EXPECT_THAT(TakeAll(&broadcaster, &late), ElementsAre());
}

std::vector<LogLine> Lines(std::vector<std::string> texts) {
  std::vector<LogLine> lines;
  for (std::string& text : texts) lines.emplace_back().line.text = std::move(text);
  return lines;
}

TEST(UpdateBroadcaster, TheLastLinesOfALogAreKept) {
  UpdateBroadcaster broadcaster;
  for (size_t i = 0; i < UpdateBroadcaster::kKeptLines + 5; ++i)
    broadcaster.AddLines(0, Lines({std::to_string(i)}));
  UpdateBroadcaster::Viewer viewer;
  broadcaster.Enter(&viewer);
  auto blocks = TakeAll(&broadcaster, &viewer);
  ASSERT_EQ(blocks.size(), 1u);
  EXPECT_EQ(Head(blocks[0])["block"], "log");
  EXPECT_EQ(Head(blocks[0])["lines"].size(), UpdateBroadcaster::kKeptLines);
  EXPECT_EQ(Head(blocks[0])["lines"][0]["text"], "5");
  broadcaster.AddLines(0, Lines({"a", "b"}));
  blocks = TakeAll(&broadcaster, &viewer);
  ASSERT_EQ(blocks.size(), 1u);
  EXPECT_EQ(Head(blocks[0])["lines"].size(), 2u);
  EXPECT_EQ(Head(blocks[0])["lines"][1]["text"], "b");
}

TEST(UpdateBroadcaster, TheBoardComesFirstAndNotesOncePerChange) {
  UpdateBroadcaster broadcaster;
  UpdateBroadcaster::Viewer viewer, late;
  broadcaster.Enter(&viewer);
  broadcaster.SetRun(0, "run");
  broadcaster.SetNotes(0, "notes");
  broadcaster.SetBoard("board");
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre("board", "run", "notes"));
  broadcaster.SetNotes(0, "more notes");
  broadcaster.SetBoard("board 2");
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre("board 2", "more notes"));
  EXPECT_THAT(TakeAll(&broadcaster, &viewer), ElementsAre());
  broadcaster.Enter(&late);
  EXPECT_THAT(TakeAll(&broadcaster, &late), ElementsAre("board 2", "run", "more notes"));
}

}  // namespace evalbus::viz::update_broadcaster_test
