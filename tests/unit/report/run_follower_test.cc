// Tests that readers follow a run on disk while it grows, is rewritten, and is resumed.
#include "report/run_follower.h"

#include <gmock/gmock.h>

#include <chrono>
#include <fstream>

#include "metrics/statistics/confidence_sequence.h"
#include "metrics/statistics/interval.h"
#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::report::run_follower_test {

using testing::ElementsAre;
using testing::HasSubstr;

class Followed : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(run_);
    results::WriteFile(run_ / kRunJson, results::RunInfo(5).dump());
  }
  static std::string Line(int episode, bool success) {
    return results::EpisodeLine(episode, success).dump() + "\n";
  }
  void Append(const std::string& text) { std::ofstream(run_ / kEpisodesJsonl, std::ios::app) << text; }
  // Replaces the file, as a run does at its end.
  void WriteAnew(const std::string& text) {
    std::ofstream(run_ / "new") << text;
    std::filesystem::rename(run_ / "new", run_ / kEpisodesJsonl);
  }
  static std::vector<int> Numbers(const RunFollower::News& news) {
    std::vector<int> numbers;
    for (const viz::EpisodeRow& row : news.rows) numbers.push_back(row.episode);
    return numbers;
  }

  TemporaryFolder folder_;
  std::filesystem::path run_ = folder_.path() / "run";
  RunFollower follower_{run_};
};

TEST_F(Followed, ReturnsAddedEpisodes) {
  RunFollower::News news = follower_.Update();
  EXPECT_TRUE(news.is_changed);
  EXPECT_EQ(follower_.numbers().planned, 5);
  EXPECT_EQ(follower_.numbers().done, 0);
  Append(Line(0, true) + Line(1, false));
  news = follower_.Update();
  EXPECT_EQ(news.from, 0u);
  EXPECT_THAT(Numbers(news), ElementsAre(0, 1));
  EXPECT_EQ(news.rows[1].failure_reason, "timeout");
  EXPECT_DOUBLE_EQ(news.rows[1].time, 4);
  EXPECT_FALSE(news.rows[1].has_track);
  EXPECT_FALSE(follower_.Update().is_changed);
  // A line that is still being written is not read yet.
  const std::string line = Line(2, true);
  Append(line.substr(0, 20));
  EXPECT_FALSE(follower_.Update().is_changed);
  Append(line.substr(20));
  news = follower_.Update();
  EXPECT_EQ(news.from, 2u);
  EXPECT_THAT(Numbers(news), ElementsAre(2));
  EXPECT_EQ(follower_.numbers().done, 3);
  EXPECT_EQ(follower_.numbers().complete, 3);
  EXPECT_EQ(follower_.numbers().successes, 2);
  EXPECT_THAT(follower_.numbers().failure_reasons, ElementsAre(std::pair("timeout", 1)));
}

TEST_F(Followed, EveryStageHasItsName) {
  Append(Line(0, true));
  follower_.Update();
  EXPECT_TRUE(follower_.stage_names().empty()) << "an older version";
  nlohmann::ordered_json line =
      results::EpisodeLine(1, true, {{"task_stage_reached", {{"1", true}, {"3", false}, {"4", false}}}});
  line["stage_names"] = {{"1", "pot_held"}, {"3", "pot_lifted"}, {"x", "no number"}, {"4", 4}};
  Append(line.dump() + "\n");
  follower_.Update();
  EXPECT_EQ(follower_.error(), "");
  EXPECT_THAT(follower_.stage_names(), ElementsAre(std::pair(1, "pot_held"), std::pair(3, "pot_lifted")));
}

TEST_F(Followed, IntervalsAreThoseOfTheRunsState) {
  Append(Line(0, true) + Line(1, false));
  follower_.Update();
  EXPECT_FALSE(follower_.is_over());
  EXPECT_DOUBLE_EQ(follower_.numbers().lower, metrics::ConfidenceSequence(1, 2).lower);
  std::ofstream(run_ / kSummaryJson) << "{}";
  follower_.Update();
  EXPECT_FALSE(follower_.is_over()) << "the run was interrupted";
  Append(Line(2, true) + Line(3, true) + Line(4, true));
  EXPECT_TRUE(follower_.Update().is_changed);
  EXPECT_TRUE(follower_.is_over());
  EXPECT_DOUBLE_EQ(follower_.numbers().upper, metrics::WilsonInterval(4, 5).upper);
}

TEST_F(Followed, SomeRunsMayEndEarly) {
  nlohmann::ordered_json info = results::RunInfo(5);
  const std::pair<const char*, nlohmann::ordered_json> options[] = {{"until", "0.05"}, {"watch", true}};
  for (const auto& [key, value] : options) {
    const std::filesystem::path run = folder_.path() / key;
    std::filesystem::create_directories(run);
    nlohmann::ordered_json own = info;
    own[key] = value;
    results::WriteFile(run / kRunJson, own.dump());
    results::WriteFile(run / kEpisodesJsonl, Line(0, true));
    RunFollower follower(run);
    follower.Update();
    EXPECT_FALSE(follower.is_over()) << key;
    results::WriteFile(run / kSummaryJson, "{}");
    follower.Update();
    EXPECT_TRUE(follower.is_over()) << key;
  }
}

TEST_F(Followed, TheSameLinesWrittenAnewAreNoNews) {
  Append(Line(0, true) + Line(1, false));
  follower_.Update();
  WriteAnew(Line(0, true) + Line(1, false) + Line(2, true));
  const RunFollower::News news = follower_.Update();
  EXPECT_EQ(news.from, 2u);
  EXPECT_THAT(Numbers(news), ElementsAre(2));
  EXPECT_FALSE(follower_.Update().is_changed);
}

TEST_F(Followed, OtherLinesAreReadFromTheBegin) {
  // Two workers write lines in the order of completion; at the end of the run they are sorted.
  Append(Line(1, false) + Line(0, true));
  follower_.Update();
  WriteAnew(Line(0, true) + Line(1, false));
  RunFollower::News news = follower_.Update();
  EXPECT_EQ(news.from, 0u);
  EXPECT_THAT(Numbers(news), ElementsAre(0, 1));
  EXPECT_EQ(follower_.numbers().done, 2);
  // The run is resumed, and the line of the episode that it repeats has been removed.
  WriteAnew(Line(0, true));
  news = follower_.Update();
  EXPECT_EQ(news.from, 0u);
  EXPECT_THAT(Numbers(news), ElementsAre(0));
  EXPECT_EQ(follower_.numbers().done, 1);
}

TEST_F(Followed, AnotherRunMayTakeTheFolder) {
  Append(Line(0, true) + Line(1, true));
  follower_.Update();
  // The file keeps its inode, which also happens if a new file gets the inode of a removed one.
  results::WriteFile(run_ / kEpisodesJsonl, Line(0, false) + Line(1, false));
  nlohmann::ordered_json info = results::RunInfo(3);
  results::WriteFile(run_ / kRunJson, info.dump());
  std::filesystem::last_write_time(run_ / kRunJson,
                                   std::filesystem::file_time_type::clock::now() + std::chrono::hours(1));
  const RunFollower::News news = follower_.Update();
  EXPECT_EQ(news.from, 0u);
  EXPECT_THAT(Numbers(news), ElementsAre(0, 1));
  EXPECT_EQ(follower_.numbers().planned, 3);
  EXPECT_EQ(follower_.numbers().successes, 0);
}

TEST_F(Followed, StageNamesAreThoseOfThePresentRun) {
  const auto line = [](const nlohmann::ordered_json& stages, const nlohmann::ordered_json& names) {
    nlohmann::ordered_json result = results::EpisodeLine(0, true, {{"task_stage_reached", stages}});
    result["stage_names"] = names;
    return result.dump() + "\n";
  };
  Append(line({{"1", true}, {"2", true}}, {{"1", "pot_held"}, {"2", "pot_lifted"}}));
  follower_.Update();
  WriteAnew(line({{"1", true}}, {{"1", "pot_touched"}}));
  follower_.Update();
  EXPECT_THAT(follower_.stage_names(), ElementsAre(std::pair(1, "pot_touched")));
}

// A viewer keeps the rows before News::from.
TEST_F(Followed, AFileThatCannotBeReadKeepsTheRows) {
  Append(Line(0, true) + Line(1, true));
  follower_.Update();
  std::filesystem::rename(run_ / kEpisodesJsonl, run_ / "kept");
  std::filesystem::create_directory(run_ / kEpisodesJsonl);
  RunFollower::News news = follower_.Update();
  EXPECT_NE(follower_.error(), "");
  EXPECT_EQ(news.from, 2u);
  EXPECT_EQ(news.rows.size(), 0u);
  std::filesystem::remove(run_ / kEpisodesJsonl);
  std::filesystem::rename(run_ / "kept", run_ / kEpisodesJsonl);
  Append(Line(2, true));
  news = follower_.Update();
  EXPECT_EQ(news.from, 2u);
  EXPECT_THAT(Numbers(news), ElementsAre(2));
}

TEST_F(Followed, ALongListComesInPieces) {
  std::string lines;
  constexpr int kMany = 2 * static_cast<int>(RunFollower::kLinesAtOnce) + 7;
  for (int i = 0; i < kMany; ++i) lines += Line(i, true);
  Append(lines);
  EXPECT_EQ(follower_.Update().rows.size(), RunFollower::kLinesAtOnce);
  EXPECT_EQ(follower_.Update().rows.size(), RunFollower::kLinesAtOnce);
  const RunFollower::News last = follower_.Update();
  EXPECT_EQ(last.from, 2 * RunFollower::kLinesAtOnce);
  EXPECT_EQ(last.rows.size(), 7u);
  EXPECT_EQ(follower_.numbers().done, kMany);
}

TEST_F(Followed, UnknownKeysAreReportedWithTheirLine) {
  Append(Line(0, true) + "nonsense\n");
  const RunFollower::News news = follower_.Update();
  EXPECT_THAT(Numbers(news), ElementsAre(0));
  EXPECT_THAT(follower_.error(), HasSubstr("episodes.jsonl:2"));
  EXPECT_FALSE(follower_.Update().is_changed);
  EXPECT_EQ(follower_.numbers().done, 1);
}

TEST(RunFollower, AFolderMayComeLater) {
  TemporaryFolder folder;
  RunFollower follower(folder.path() / "later");
  EXPECT_FALSE(follower.Update().is_changed);
  EXPECT_EQ(follower.info(), nullptr);
  EXPECT_TRUE(follower.error().empty());
}

}  // namespace evalbus::report::run_follower_test
