#include "results/compared_runs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/results/compare_fixture.h"

namespace evalbus::results::compared_runs_test {

using testing::ElementsAre;

TEST(DistinctNames, AreThePartsThatDiffer) {
  EXPECT_THAT(DistinctNames({"plan/expert/lift_pot", "plan/noisy/lift_pot"}), ElementsAre("expert", "noisy"));
  EXPECT_THAT(DistinctNames({"/a/b/run", "./c/run", "run2/../d/e/run"}), ElementsAre("/a/b", "c", "d/e"));
  EXPECT_THAT(DistinctNames({"a/1/x", "a/2/y"}), ElementsAre("1/x", "2/y"));
}

TEST(DistinctNames, AreWholePathsIfNothingElseDiffers) {
  EXPECT_THAT(DistinctNames({"run", "old/run"}), ElementsAre("run", "old/run"));
  EXPECT_THAT(DistinctNames({"a/run", "a/run"}), ElementsAre("a/run", "a/run"));
}

// In episodes 0 and 1, one side has no result that counts, so episode 2 is the first with one success.
TEST_F(CompareTest, SeedPairsWithOneSuccessHaveTwoVerdicts) {
  RecordedRuns a = Run("a", Info(4), First(4, 4), 4), b = Run("b", Info(4), {false, false, false, true}, 4);
  const auto episode_of = [&](std::optional<int64_t> seed) { return FindSeedPair(a, b, seed)->episode; };
  EXPECT_EQ(episode_of(std::nullopt), 0);
  b.runs[0].episodes[0].complete = false;
  b.runs[0].episodes[1].failure_reason = "not_judged";
  EXPECT_EQ(episode_of(std::nullopt), 2);
  EXPECT_EQ(episode_of(a.runs[0].episodes[1].seed), 1);
  // Without such a pair, the first common seed is shown.
  b.runs[0].episodes[2].success = true;
  EXPECT_EQ(episode_of(std::nullopt), 0);
}

}  // namespace evalbus::results::compared_runs_test
