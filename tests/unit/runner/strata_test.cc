#include "runner/strata.h"

#include <gmock/gmock.h>

#include <random>
#include <set>

namespace evalbus::runner::strata_test {

using testing::ElementsAre;

TEST(Strata, AreNeighborsOnALine) {
  EXPECT_THAT(Strata({{5}, {1}, {4}, {0}, {3}, {2}}, 3),
              ElementsAre(ElementsAre(1, 3), ElementsAre(4, 5), ElementsAre(0, 2)));
}

TEST(Strata, UnitsDoNotMatter) {
  // The points are the corners of a rectangle of 0.001 by 1,000,000. Each axis is cut once.
  EXPECT_THAT(Strata({{0, 0}, {0, 1e6}, {1e-3, 0}, {1e-3, 1e6}}, 4),
              ElementsAre(ElementsAre(0), ElementsAre(1), ElementsAre(2), ElementsAre(3)));
}

TEST(Strata, OfPointsThatAreEqualAreTheirOrder) {
  EXPECT_THAT(Strata({{}, {}, {}, {}}, 2), ElementsAre(ElementsAre(0, 1), ElementsAre(2, 3)));
  EXPECT_THAT(Strata({{7}, {7}}, 2), ElementsAre(ElementsAre(0), ElementsAre(1)));
}

TEST(Strata, HaveOneChosenIndexEach) {
  EXPECT_THAT(FirstOfEach({{0, 2}, {1, 3}, {4, 5}}, {0, 2, 3}), ElementsAre(0, 3));
  EXPECT_TRUE(FirstOfEach({{0, 2}}, {}).empty());
}

TEST(Strata, CoverASquareMoreEvenlyThanDrawing) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform;
  std::vector<std::vector<double>> points;
  for (int k = 0; k < 64 * 8; ++k) points.push_back({uniform(random), uniform(random)});
  const auto strata = Strata(points, 64);
  ASSERT_EQ(strata.size(), 64u);
  // Returns how many of the 64 squares contain no chosen point. One point of each stratum is compared with
  // the first 64.
  const auto empty = [&](const std::vector<int>& chosen) {
    std::set<std::pair<int, int>> hit;
    for (const int k : chosen) {
      const auto& point = points[static_cast<size_t>(k)];
      hit.emplace(static_cast<int>(point[0] * 8), static_cast<int>(point[1] * 8));
    }
    return 64 - static_cast<int>(hit.size());
  };
  std::vector<int> one_of_each, first;
  std::set<int> all;
  for (int k = 0; k < 64; ++k) {
    const auto& stratum = strata[static_cast<size_t>(k)];
    EXPECT_EQ(stratum.size(), 8u);
    one_of_each.push_back(stratum[0]);
    first.push_back(k);
    all.insert(stratum.begin(), stratum.end());
  }
  EXPECT_EQ(all.size(), points.size());
  // With 64 random starts, 1/e of all squares, about 23, remain empty.
  EXPECT_GT(empty(first), 17);
  EXPECT_LT(empty(one_of_each), empty(first) - 3);
}

}  // namespace evalbus::runner::strata_test
