// Tests axis marks, bins, paths and names of the report's figures with values that were computed by hand.
#include "report/page/scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "report/page/figures.h"

namespace evalbus::report::scale_test {

using testing::ElementsAre;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(Ticks, AreMultiplesOfOneTwoOrFive) {
  EXPECT_THAT(TicksWithin(0, 10, 6).at, ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_THAT(TicksWithin(0, 10, 5).at, ElementsAre(0, 5, 10));
  EXPECT_THAT(TicksWithin(0, 5.46, 6).at, ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(TicksWithin(-0.7, 0.7, 3).at, ElementsAre(-0.5, 0, 0.5));
  EXPECT_THAT(TicksWithin(1200, 5100, 3).at, ElementsAre(2000, 4000));
}

TEST(Ticks, AreTheDoublesNearestToTheDecimals) {
  const Ticks ticks = TicksWithin(0, 0.5, 6);
  EXPECT_THAT(ticks.at, ElementsAre(0.0, 0.1, 0.2, 0.3, 0.4, 0.5));
  EXPECT_EQ(ticks.step, 0.1);
}

TEST(Ticks, AroundEncloseTheRange) {
  EXPECT_THAT(TicksAround(0.3, 9.1, 6).at, ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_THAT(TicksAround(2, 8, 4).at, ElementsAre(2, 4, 6, 8));
  EXPECT_THAT(TicksAround(-1, 11, 6).at, ElementsAre(-5, 0, 5, 10, 15));
}

TEST(Ticks, NeverMoreThanRequested) {
  for (const double upper : {1e-9, 0.0301, 0.999, 1.0, 7.0, 49.99, 123456.0, 3e12}) {
    for (int most = 2; most < 9; ++most) {
      const auto within = TicksWithin(0, upper, most).at;
      const auto around = TicksAround(0, upper, most).at;
      EXPECT_LE(within.size(), static_cast<size_t>(most)) << upper;
      EXPECT_LE(around.size(), static_cast<size_t>(most)) << upper;
      EXPECT_LE(within.back(), upper * (1 + 1e-9));
      EXPECT_GE(around.back(), upper * (1 - 1e-9));
      EXPECT_GE(around.size(), 2u);
    }
  }
}

TEST(Ticks, ValuesThatDifferByRoundingAreNoRange) {
  EXPECT_FALSE(IsRange(14.58, std::nextafter(14.58, 15)));
  EXPECT_FALSE(IsRange(-3e6, -3e6));
  EXPECT_FALSE(IsRange(0, 0));
  EXPECT_TRUE(IsRange(0, 1e-12));
  EXPECT_TRUE(IsRange(14.58, 14.5801));
}

TEST(Bins, OfSmallIntegersStandAroundThem) {
  EXPECT_THAT(BinEdges(std::vector<double>{0, 2, 0, 1}), ElementsAre(-0.5, 0.5, 1.5, 2.5));
  EXPECT_THAT(CountInBins(std::vector<double>{0, 2, 0, 1}, std::vector<double>{-0.5, 0.5, 1.5, 2.5}),
              ElementsAre(2, 1, 1));
}

TEST(Bins, HaveRoundEdgesThatEncloseTheValues) {
  // Bins of 1 would be too many: 17 from 3 to 20. Bins of 2, from 2 to 20, are nine.
  EXPECT_THAT(BinEdges(std::vector<double>{3.7, 20, 5.5}), ElementsAre(2, 4, 6, 8, 10, 12, 14, 16, 18, 20));
}

TEST(Bins, LowerEdgeBelongsToThemAndTheLastUpperOne) {
  const std::vector<double> edges = {0.1, 0.2, 0.3, 0.4};
  EXPECT_THAT(CountInBins(std::vector<double>{0.1, 0.2, 0.3, 0.4, 0.35}, edges), ElementsAre(1, 1, 3));
}

TEST(Number, HasFourSignificantDigits) {
  EXPECT_EQ(Number(0), "0");
  EXPECT_EQ(Number(5.6850000000000005), "5.685");
  EXPECT_EQ(Number(0.14182345), "0.1418");
  EXPECT_EQ(Number(-12345.6), "-12346");
  EXPECT_EQ(Number(0.000651132), "0.0006511");
  EXPECT_EQ(Number(kNaN), "-");
}

// tests/browser/page_functions.js tests the same rule of the page's scripts.
TEST(LineColor, IsThatOfTheArm) {
  const auto colors = [](const std::vector<std::string>& names) {
    std::vector<std::string> all;
    for (size_t k = 0; k < names.size(); ++k) all.push_back(LineColor(names[k], k));
    return all;
  };
  EXPECT_THAT(colors({"left", "right_gripper_to_pot", "lift distance", "leftover", "pot to left"}),
              ElementsAre("left", "right", "o2", "o3", "left"));
  EXPECT_EQ(LineColor("", 0), "");
}

TEST(Path, GoesThroughThePointsThatMatter) {
  const Axis x{0, 10, 100, 200}, y{0, 1, 50, 0};
  // The points form a line, a corner and another line. The second and fourth points lie on the lines and are
  // omitted.
  EXPECT_EQ(PathOf(std::vector<double>{0, 1, 5, 7, 10}, std::vector<double>{0, 0.2, 1, 0.6, 0}, x, y),
            "M100 50L150 0L200 50");
}

TEST(Path, IsInterruptedWhereThereIsNoValue) {
  const Axis x{0, 4, 0, 40}, y{0, 1, 10, 0};
  EXPECT_EQ(PathOf(std::vector<double>{0, 1, 2, 3, 4}, std::vector<double>{0, 1, kNaN, 0.25, 0.5}, x, y),
            "M0 10L10 0M30 7.5L40 5");
  EXPECT_EQ(PathOf(std::vector<double>{0}, std::vector<double>{kNaN}, x, y), "");
}

TEST(Path, StaysWithinAQuarterOfAPixel) {
  std::vector<double> time, value;
  for (int i = 0; i <= 2000; ++i) {
    time.push_back(i);
    value.push_back(std::sin(i * 0.01));
  }
  const Axis x{0, 2000, 0, 300}, y{-1, 1, 100, 0};
  const std::string path = PathOf(time, value, x, y);
  // Every sample is close to the line between neighboring points of the path.
  std::vector<std::pair<double, double>> points;
  for (const char* at = path.c_str(); *at;) {
    char* end;
    const double px = std::strtod(at + 1, &end);
    const double py = std::strtod(end, &end);
    points.emplace_back(px, py);
    at = end;
  }
  ASSERT_LT(points.size(), 200u);
  size_t k = 0;
  for (size_t i = 0; i < time.size(); ++i) {
    const double px = x(time[i]), py = y(value[i]);
    while (k + 2 < points.size() && points[k + 1].first < px) ++k;
    const auto [ax, ay] = points[k];
    const auto [bx, by] = points[k + 1];
    const double length = std::hypot(bx - ax, by - ay);
    EXPECT_LT(std::abs((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / length, 0.25 + 0.15) << i;
  }
}

}  // namespace evalbus::report::scale_test
