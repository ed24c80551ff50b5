#include "results/blind_order.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "tests/unit/results/compare_fixture.h"

namespace evalbus::results::blind_order_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

// Pairs episode k of run 0 with episode 100 + k of run 1.
std::vector<std::pair<int, int>> Pairs(int count) {
  std::vector<std::pair<int, int>> pairs;
  for (int i = 0; i < count; ++i) pairs.emplace_back(i, 100 + i);
  return pairs;
}

TEST(BlindOrder, ShowsEachEpisodeOnceAndPairsTogether) {
  const auto order = BlindOrder(Pairs(20), 3);
  ASSERT_EQ(order.size(), 40u);
  EXPECT_EQ(std::set<JudgedEpisode>(order.begin(), order.end()).size(), 40u);
  for (size_t i = 0; i < order.size(); i += 2) {
    EXPECT_NE(order[i].run, order[i + 1].run);
    EXPECT_EQ(order[i].episode % 100, order[i + 1].episode % 100);
  }
}

TEST(BlindOrder, ShowsEachRunFirstInHalfOfThePairs) {
  std::set<int> firsts_of_odd;
  for (int64_t seed = 0; seed < 20; ++seed) {
    const auto firsts = [seed](int count) {
      const auto order = BlindOrder(Pairs(count), seed);
      int firsts_of_run_0 = 0;
      for (size_t i = 0; i < order.size(); i += 2) firsts_of_run_0 += order[i].run == 0;
      return firsts_of_run_0;
    };
    EXPECT_EQ(firsts(20), 10) << seed;
    firsts_of_odd.insert(firsts(7));
  }
  // With an odd number of pairs, neither run is always first in the additional pair.
  EXPECT_THAT(firsts_of_odd, ElementsAre(3, 4));
}

TEST(BlindOrder, IsThatOfItsSeed) {
  EXPECT_EQ(BlindOrder(Pairs(12), 5), BlindOrder(Pairs(12), 5));
  EXPECT_NE(BlindOrder(Pairs(12), 5), BlindOrder(Pairs(12), 6));
  // The previous pair does not predict which run comes first. Over many seeds, each order follows each order.
  std::set<std::pair<int, int>> successions;
  for (int64_t seed = 0; seed < 50; ++seed) {
    const auto order = BlindOrder(Pairs(4), seed);
    successions.emplace(order[0].run, order[2].run);
  }
  EXPECT_EQ(successions.size(), 4u);
}

class EpisodesOfEqualSeedsTest : public CompareTest {};

TEST_F(EpisodesOfEqualSeedsTest, LeavesOutEpisodesWithoutACounterpart) {
  const auto a = Run("a", Info(3), First(1, 3), 4).runs[0], b = Run("b", Info(5), First(1, 5), 4).runs[0];
  EXPECT_THAT(EpisodesOfEqualSeeds(a, b), ElementsAre(Pair(0, 0), Pair(1, 1), Pair(2, 2)));
}

TEST_F(EpisodesOfEqualSeedsTest, RefusesRunsThatCannotBePaired) {
  const auto a = Run("a", Info(3), First(1, 3), 4).runs[0],
             other = Run("c", Info(3, 8), First(1, 3), 4).runs[0];
  const auto refusal = [&](const RecordedRun& b) -> std::string {
    try {
      EpisodesOfEqualSeeds(a, b);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(other), HasSubstr("no seed in common"));
  RecordedRun another = a;
  another.variation = "base";
  EXPECT_THAT(refusal(another), HasSubstr("same task and variation"));
  EXPECT_THAT(refusal(a), HasSubstr("given twice"));
}

}  // namespace evalbus::results::blind_order_test
