// Tests the scoreboard of `evalbus web`. `results` computes its statistics, so counts are compared with
// values counted by hand, and differences with CompareVerdicts().
#include "report/web/board.h"

#include <gmock/gmock.h>

#include "metrics/statistics/confidence_sequence.h"
#include "metrics/statistics/interval.h"
#include "results/comparison.h"
#include "tests/unit/results/compare_fixture.h"
#include "viz/viewer/block.h"

namespace evalbus::report::board_test {

using nlohmann::ordered_json;
using results::RecordedRun;

class BoardTest : public results::CompareTest {
 protected:
  // Returns a run in which a success reaches two stages and a failure one. Each episode has `slips` slips.
  RecordedRun Make(const std::string& name, const std::vector<bool>& success, int slips = 0,
                   const ordered_json& info = results::Info(10)) {
    std::vector<ordered_json> lines;
    for (size_t i = 0; i < success.size(); ++i) {
      const int n = static_cast<int>(i);
      lines.push_back(results::EpisodeLine(n, success[i],
                                           {{"completion_time", success[i] ? 4.0 + n : 20.0},
                                            {"slip_count", slips},
                                            {"task_stage_reached", {{"1", true}, {"2", success[i]}}}}));
      lines.back()["extended"]["grasp_count"] = {{"left", 1}, {"right", 1}};
    }
    results::WriteRun(folder_.path() / name, info, lines);
    return results::ReadRun(folder_.path() / name);
  }
  static ordered_json Board(const std::vector<BoardRun>& runs, const BoardFacts& facts = {}) {
    return viz::BlockReader(BoardBlock(runs, facts)).head();
  }
};

TEST_F(BoardTest, CountsAndDifferences) {
  const RecordedRun a = Make("a", First(9, 10)), b = Make("b", First(4, 10), 1);
  const ordered_json board =
      Board({{.number = 0,
              .policy = "expert",
              .source = "x",
              .is_over = true,
              .run = &a,
              .stage_names = {{2, "pot_lifted"}}},
             {.number = 1, .policy = "noisy", .source = "y", .is_over = true, .run = &b}});
  EXPECT_EQ(board["tasks"][0]["name"], "lift_pot/position");
  EXPECT_EQ(board["tasks"][0]["stage_names"], ordered_json::parse(R"([[2, "pot_lifted"]])"));
  EXPECT_EQ(board["is_over"], true);
  const ordered_json &expert = board["policies"][0], &noisy = board["policies"][1];
  EXPECT_EQ(expert["name"], "expert");
  EXPECT_EQ(expert["runs"], ordered_json({0}));
  EXPECT_EQ(expert["runs_done"], ordered_json({10}));
  EXPECT_EQ(board["num_policies"], 2);
  EXPECT_EQ(board["num_tasks"], 1);
  EXPECT_EQ(expert["against"], nullptr);
  EXPECT_EQ(expert["cells"][0]["successes"], 9);
  EXPECT_EQ(expert["cells"][0]["complete"], 10);
  EXPECT_EQ(expert["cells"][0]["judged"], 10);
  EXPECT_EQ(expert["cells"][0]["interval"][0], metrics::WilsonInterval(9, 10).lower);
  EXPECT_EQ(expert["cells"][0]["stages"], ordered_json::parse("[[1, 10], [2, 9]]"));
  EXPECT_EQ(expert["cells"][0]["successes_without_stage"], 0);
  EXPECT_DOUBLE_EQ(expert["all"]["time_s"], 8);  // mean of 4 to 12
  EXPECT_EQ(expert["slips_per_episode"], 0.0);
  EXPECT_EQ(noisy["all"]["rate"], 0.4);
  EXPECT_EQ(noisy["slips_per_episode"], 1.0);  // in two grasps
  const results::SuccessComparison expected =
      results::CompareVerdicts({.folder = {}, .name = "b", .is_suite = false, .runs = {b}, .missing = {}},
                               {.folder = {}, .name = "a", .is_suite = false, .runs = {a}, .missing = {}})
          .success;
  EXPECT_EQ(noisy["against"]["difference"], -0.5);
  EXPECT_EQ(noisy["against"]["paired"], true);
  EXPECT_EQ(noisy["against"]["interval"][0], expected.difference_95.lower);
  EXPECT_EQ(noisy["against"]["p"], expected.p);
  EXPECT_EQ(noisy["against"]["is_adjusted"], false);
  EXPECT_EQ(noisy["against"]["judgment"], results::Word(expected.judgment()));
}

// For two policies the verdict is the headline of their comparison, and for three it is their rates and the
// comparisons.
TEST_F(BoardTest, TheVerdictIsASentence) {
  const RecordedRun a = Make("a", First(10, 10)), b = Make("b", First(0, 10)), c = Make("c", First(1, 10));
  std::vector<BoardRun> runs = {{.number = 0, .policy = "a", .source = "x", .is_over = true, .run = &a}};
  EXPECT_EQ(Board(runs)["verdict"], "");
  runs.push_back({.number = 1, .policy = "b", .source = "x", .is_over = true, .run = &b});
  EXPECT_THAT(std::string(Board(runs)["verdict"]),
              testing::StartsWith("b is 100 points worse than a, 95 % CI "));
  EXPECT_THAT(std::string(Board(runs, {.baseline = "b", .is_sequential = false})["verdict"]),
              testing::StartsWith("a is 100 points better than b, 95 % CI "));
  EXPECT_EQ(Board(runs, {.baseline = "a", .is_sequential = true})["verdict"], "");
  runs.push_back({.number = 2, .policy = "c", .source = "x", .is_over = true, .run = &c});
  EXPECT_EQ(Board(runs)["verdict"], "a 100 %, c 10 %, b 0 %; b and c are worse than a");
  EXPECT_EQ(Board(runs)["policies"][2]["against"]["is_adjusted"], true);
  runs.back().is_over = false;
  EXPECT_EQ(Board(runs)["verdict"], "");
}

// While episodes of a run are missing, its interval is anytime-valid, and no policy is called better or
// worse.
TEST_F(BoardTest, ActiveRunsAreNotJudged) {
  const RecordedRun a = Make("a", First(10, 10)), b = Make("b", First(0, 10));
  const std::vector<BoardRun> runs = {
      {.number = 0, .policy = "a", .source = "x", .is_over = true, .run = &a},
      {.number = 1, .policy = "b", .source = "x", .is_over = false, .run = &b}};
  const ordered_json board = Board(runs);
  EXPECT_EQ(board["is_over"], false);
  EXPECT_EQ(board["policies"][0]["all"]["interval"][0], metrics::WilsonInterval(10, 10).lower);
  EXPECT_NE(board["policies"][1]["all"]["interval"][1], metrics::WilsonInterval(0, 10).upper);
  EXPECT_EQ(board["policies"][1]["against"]["difference"], -1.0);
  EXPECT_EQ(board["policies"][1]["against"]["p"], nullptr);
  EXPECT_EQ(board["policies"][1]["against"]["judgment"], "");
}

// The policy "b" and the task "stack" of the plan have no run yet.
TEST_F(BoardTest, PoliciesAndTasksOfAPlanAreCountedBeforeTheirRunsBegin) {
  const RecordedRun a = Make("a", First(1, 1));
  BoardFacts facts;
  facts.policies = {"a", "b"};
  facts.tasks = {"lift_pot/position", "stack/position"};
  facts.waiting_runs = 3;
  const ordered_json board =
      Board({{.number = 0, .policy = "a", .source = "x", .is_over = true, .run = &a}}, facts);
  EXPECT_EQ(board["num_policies"], 2);
  EXPECT_EQ(board["num_tasks"], 2);
  EXPECT_EQ(board["policies"].size(), 1u);
}

TEST_F(BoardTest, APlanThatTestsItselfIsNotTestedAgain) {
  const RecordedRun a = Make("a", First(10, 10)), b = Make("b", First(0, 10));
  const std::vector<BoardRun> runs = {
      {.number = 0, .policy = "a", .source = "x", .is_over = true, .run = &a},
      {.number = 1, .policy = "b", .source = "x", .is_over = true, .run = &b}};
  EXPECT_NE(Board(runs)["policies"][1]["against"]["judgment"], "");
  EXPECT_EQ(Board(runs, {.baseline = "a", .is_sequential = true})["policies"][1]["against"]["judgment"], "");
}

TEST_F(BoardTest, TheBaselineIsTheOneOfThePlan) {
  const RecordedRun a = Make("a", First(10, 10)), b = Make("b", First(0, 10));
  const ordered_json board = Board({{.number = 0, .policy = "a", .source = "x", .is_over = true, .run = &a},
                                    {.number = 1, .policy = "b", .source = "x", .is_over = true, .run = &b}},
                                   {.baseline = "b", .is_sequential = false});
  EXPECT_EQ(board["baseline"], 1);
  EXPECT_EQ(board["policies"][0]["against"]["difference"], 1.0);
}

// A plan has not finished while a run has not begun or a shard has not arrived.
TEST_F(BoardTest, APlanIsOverWhenAllOfItsRunsAre) {
  const RecordedRun a = Make("a", First(10, 10)), b = Make("b", First(0, 10));
  const std::vector<BoardRun> runs = {
      {.number = 0, .policy = "a", .source = "x", .is_over = true, .run = &a},
      {.number = 1, .policy = "b", .source = "x", .is_over = true, .run = &b}};
  ordered_json board = Board(runs);
  EXPECT_EQ(board["is_over"], true);
  EXPECT_EQ(board["planned"], 20);
  EXPECT_EQ(board["waiting_runs"], 0);
  BoardFacts facts;
  facts.waiting_runs = 2;
  facts.waiting_episodes = 20;
  board = Board(runs, facts);
  EXPECT_EQ(board["is_over"], false);
  EXPECT_EQ(board["planned"], 40);
  EXPECT_EQ(board["waiting_runs"], 2);
  EXPECT_EQ(board["verdict"], "");
  EXPECT_EQ(board["policies"][1]["against"]["judgment"], "");

  ordered_json info = results::Info(10);
  info["only"] = {0, 1};
  const RecordedRun shard = Make("shard", First(2, 2), 0, info);
  std::vector<BoardRun> shards = {
      {.number = 0, .policy = "a", .source = "x", .is_over = true, .planned = 4, .run = &shard}};
  board = Board(shards);
  EXPECT_EQ(board["is_over"], false);
  EXPECT_EQ(board["planned"], 4);
  shards.push_back(shards[0]);  // the other two episodes
  board = Board(shards);
  EXPECT_EQ(board["is_over"], true);
  EXPECT_EQ(board["planned"], 4);
}

// Shards of one run form one cell. Runs of one policy in two folders form two rows.
TEST_F(BoardTest, ShardsAreOneRunAndFoldersAreApart) {
  ordered_json first_info = results::Info(10), second_info = first_info;
  first_info["only"] = {0, 1};
  second_info["only"] = {2, 3, 4};
  RecordedRun first = Make("first", First(2, 2), 0, first_info),
              second = Make("second", First(3, 3), 0, second_info);
  for (results::RecordedEpisode& episode : second.episodes) episode.episode += 2;
  const ordered_json shards =
      Board({{.number = 0, .policy = "a", .source = "plan", .is_over = true, .run = &first},
             {.number = 1, .policy = "a", .source = "plan", .is_over = true, .run = &second}});
  ASSERT_EQ(shards["policies"].size(), 1u);
  EXPECT_EQ(shards["policies"][0]["cells"][0]["successes"], 5);
  EXPECT_EQ(shards["policies"][0]["planned"], 5);
  EXPECT_EQ(shards["policies"][0]["runs"], ordered_json({0, 1}));
  const ordered_json apart =
      Board({{.number = 0, .policy = "a", .source = "runs/x", .is_over = true, .run = &first},
             {.number = 1, .policy = "a", .source = "runs/y", .is_over = true, .run = &second}});
  ASSERT_EQ(apart["policies"].size(), 2u);
  EXPECT_EQ(apart["policies"][1]["name"], "a (runs/y)");
}

TEST_F(BoardTest, RunsThatCannotBeComparedHaveTheReason) {
  const RecordedRun a = Make("a", First(10, 10)), b = Make("b", First(0, 10), 0, results::Info(10, 7, 25));
  const RecordedRun none = Make("none", {true});
  RecordedRun empty = none;
  empty.episodes.clear();
  const ordered_json board =
      Board({{.number = 0, .policy = "a", .source = "x", .is_over = true, .run = &a},
             {.number = 1, .policy = "b", .source = "x", .is_over = true, .run = &b},
             {.number = 2, .policy = "c", .source = "x", .is_over = true, .run = &empty}});
  EXPECT_THAT(std::string(board["policies"][1]["against"]["remark"]), testing::HasSubstr("control rate"));
  EXPECT_EQ(board["policies"][2]["against"], nullptr);
  EXPECT_EQ(board["policies"][2]["all"]["rate"], nullptr);
  EXPECT_EQ(board["policies"][2]["all"]["interval"], nullptr);
}

}  // namespace evalbus::report::board_test
