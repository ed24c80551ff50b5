#include "results/compared_runs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace evalbus::results::compared_runs_test
