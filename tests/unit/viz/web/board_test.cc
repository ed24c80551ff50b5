// Who is told what: blocks are plain words here, but for those that the board makes itself.
#include "viz/web/board.h"

#include <gmock/gmock.h>

#include "viz/viewer/block.h"

namespace evalbus::viz::board_test {

using testing::ElementsAre;

std::vector<std::string> TakeAll(Board* board, Board::Viewer* viewer) {
  std::vector<std::string> blocks;
  while (const SharedBytes block = board->Next(viewer)) blocks.push_back(*block);
  return blocks;
}

nlohmann::ordered_json Head(const std::string& block) { return BlockReader(block).head(); }

std::vector<EpisodeRow> Rows(const std::vector<int>& episodes) {
  std::vector<EpisodeRow> rows;
  for (const int episode : episodes) rows.emplace_back().episode = episode;
  return rows;
}

TEST(Board, AViewerIsToldWhatIsNewAndNotWhatWasInBetween) {
  Board board;
  Board::Viewer viewer;
  board.Enter(&viewer);
  board.SetRun(0, "a");
  board.SetRun(0, "b");
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre("b"));
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre());
  board.SetRun(0, "c");
  board.SetRun(1, "other");
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre("c", "other"));
}

TEST(Board, WhoComesInMidEpisodeIsGivenAllOfItAndThenTicks) {
  Board board;
  Board::Viewer viewer;
  board.Enter(&viewer);
  EXPECT_TRUE(board.is_watched(0));
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre());
  EXPECT_TRUE(board.needs_episode(0));
  board.SetEpisode(0, "episode to 10", true);
  board.AddTicks(0, "10 to 12");
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre("episode to 10", "10 to 12"));
  EXPECT_FALSE(board.needs_episode(0));
  // The next one is served by what is there.
  Board::Viewer late;
  board.Enter(&late);
  EXPECT_THAT(TakeAll(&board, &late), ElementsAre("episode to 10", "10 to 12"));
  board.AddTicks(0, "12 to 14");
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre("12 to 14"));
  EXPECT_THAT(TakeAll(&board, &late), ElementsAre("12 to 14"));
}

TEST(Board, WhoDoesNotReadLosesTicksAndIsGivenTheWholeEpisodeAgain) {
  Board board;
  Board::Viewer slow, quick;
  board.Enter(&slow);
  board.Enter(&quick);
  board.SetEpisode(0, "episode", true);
  TakeAll(&board, &slow);
  TakeAll(&board, &quick);
  for (size_t i = 0; i <= Board::kKeptTicks; ++i) {
    board.AddTicks(0, "ticks");
    EXPECT_THAT(TakeAll(&board, &quick), ElementsAre("ticks"));
  }
  EXPECT_FALSE(board.needs_episode(0));
  EXPECT_THAT(TakeAll(&board, &slow), ElementsAre());
  EXPECT_TRUE(board.needs_episode(0));
  board.SetEpisode(0, "episode now", false);
  EXPECT_THAT(TakeAll(&board, &slow), ElementsAre("episode now"));
  // Who has it all is not told again.
  EXPECT_THAT(TakeAll(&board, &quick), ElementsAre());
  board.AddTicks(0, "further");
  EXPECT_THAT(TakeAll(&board, &slow), ElementsAre("further"));
  EXPECT_THAT(TakeAll(&board, &quick), ElementsAre("further"));
}

TEST(Board, ManyBytesOfTicksAreNotKept) {
  Board board;
  Board::Viewer viewer;
  board.Enter(&viewer);
  board.SetEpisode(0, "episode", true);
  TakeAll(&board, &viewer);
  for (int i = 0; i < 3; ++i) board.AddTicks(0, std::string(Board::kKeptTickBytes / 2, 'x'));
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre());
  EXPECT_TRUE(board.needs_episode(0));
}

TEST(Board, ANewEpisodeGoesToEverybody) {
  Board board;
  Board::Viewer viewer, behind;
  board.Enter(&viewer);
  board.Enter(&behind);
  board.SetEpisode(0, "episode 0", true);
  board.AddTicks(0, "ticks of 0");
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre("episode 0", "ticks of 0"));
  EXPECT_EQ(*board.Next(&behind), "episode 0");
  board.SetEpisode(0, "episode 1", true);
  board.AddTicks(0, "ticks of 1");
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre("episode 1", "ticks of 1"));
  EXPECT_THAT(TakeAll(&board, &behind), ElementsAre("episode 1", "ticks of 1"));
}

TEST(Board, WatchingAnotherRunBringsItsEpisode) {
  Board board;
  Board::Viewer viewer;
  board.Enter(&viewer);
  EXPECT_FALSE(board.Watch(&viewer, 1));
  board.SetRun(1, "run 1");
  board.SetEpisode(1, "episode of 1", true);
  board.SetEpisode(0, "episode of 0", true);
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre("run 1", "episode of 0"));
  EXPECT_TRUE(board.Watch(&viewer, 1));
  EXPECT_FALSE(board.is_watched(0));
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre("episode of 1"));
  board.AddTicks(0, "of nobody");
  EXPECT_THAT(TakeAll(&board, &viewer), ElementsAre());
  board.Leave(&viewer);
  EXPECT_FALSE(board.is_watched(1));
  EXPECT_EQ(board.num_viewers(), 0);
}

TEST(Board, WhoLeavesWaitsForNothing) {
  Board board;
  Board::Viewer viewer;
  board.Enter(&viewer);
  TakeAll(&board, &viewer);
  EXPECT_TRUE(board.needs_episode(0));
  board.Leave(&viewer);
  EXPECT_FALSE(board.needs_episode(0));
}

TEST(Board, AListComesInPiecesAndThenWhatIsAdded) {
  Board board;
  std::vector<EpisodeRow> episodes(33'000);
  for (int i = 0; i < 33'000; ++i) episodes[static_cast<size_t>(i)].episode = i;
  board.SetEpisodes(0, 0, episodes);
  Board::Viewer viewer;
  board.Enter(&viewer);
  int next = 0;
  size_t blocks = 0;
  for (; const SharedBytes block = board.Next(&viewer); ++blocks) {
    const auto head = Head(*block);
    EXPECT_EQ(head["block"], "episodes");
    EXPECT_EQ(head["run"], 0);
    EXPECT_EQ(head["from"], next);
    for (const auto& episode : head["episodes"]) ASSERT_EQ(episode["episode"], next++);
  }
  EXPECT_EQ(next, 33'000);
  EXPECT_EQ(blocks, 33u);
  board.SetEpisodes(0, 33'000, Rows({33'000}));
  const auto added = TakeAll(&board, &viewer);
  ASSERT_EQ(added.size(), 1u);
  EXPECT_EQ(Head(added[0])["from"], 33'000);
  EXPECT_EQ(Head(added[0])["episodes"].size(), 1u);
  // A list that became another one (a run that was gone on with) is told from its begin.
  board.SetEpisodes(0, 2, Rows({7}));
  const auto anew = TakeAll(&board, &viewer);
  ASSERT_EQ(anew.size(), 1u);
  EXPECT_EQ(Head(anew[0])["from"], 0);
  EXPECT_EQ(Head(anew[0])["episodes"].size(), 3u);
}

std::vector<LogLine> Lines(std::vector<std::string> texts) {
  std::vector<LogLine> lines;
  for (std::string& text : texts) lines.emplace_back().line.text = std::move(text);
  return lines;
}

TEST(Board, TheLastLinesOfALogAreKept) {
  Board board;
  for (size_t i = 0; i < Board::kKeptLines + 5; ++i) board.AddLines(0, Lines({std::to_string(i)}));
  Board::Viewer viewer;
  board.Enter(&viewer);
  auto blocks = TakeAll(&board, &viewer);
  ASSERT_EQ(blocks.size(), 1u);
  EXPECT_EQ(Head(blocks[0])["block"], "log");
  EXPECT_EQ(Head(blocks[0])["lines"].size(), Board::kKeptLines);
  EXPECT_EQ(Head(blocks[0])["lines"][0]["text"], "5");
  board.AddLines(0, Lines({"a", "b"}));
  blocks = TakeAll(&board, &viewer);
  ASSERT_EQ(blocks.size(), 1u);
  EXPECT_EQ(Head(blocks[0])["lines"].size(), 2u);
  EXPECT_EQ(Head(blocks[0])["lines"][1]["text"], "b");
}

}  // namespace evalbus::viz::board_test
