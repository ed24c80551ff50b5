// Compares the result with measuring every pair, for intervals that move randomly on a line.
#include "collision/nearest_pair.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace evalbus::collision::nearest_pair_test {

struct Line {
  std::vector<double> middle, half;
  std::vector<std::pair<int, int>> pairs;
  int measured = 0;

  double Distance(int pair) const {
    const auto [a, b] = pairs[pair];
    return std::abs(middle[a] - middle[b]) - half[a] - half[b];
  }
  // Bounding boxes are larger than their contents, here by half of their size.
  double Gap(int pair) const {
    const auto [a, b] = pairs[pair];
    return std::max(0.0, Distance(pair) - 0.5 * (half[a] + half[b]));
  }
  std::optional<NearestPair::Found> Find(NearestPair* dut, double below) {
    return dut->Find(
        below, [&](int pair) { return Gap(pair); },
        [&](int pair) {
          ++measured;
          return Distance(pair);
        });
  }
};

TEST(NearestPair, IsTheOneThatMeasuringAllOfThemFinds) {
  std::mt19937_64 random(1);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  int found_any = 0, measured = 0, measured_without_memory = 0;
  for (int trial = 0; trial < 200; ++trial) {
    constexpr int kThings = 8;
    Line line;
    for (int i = 0; i < kThings; ++i) {
      line.middle.push_back(uniform(-10, 10));
      line.half.push_back(uniform(0.1, 1));
      for (int k = 0; k < i; ++k) line.pairs.emplace_back(k, i);
    }
    NearestPair dut(line.pairs, kThings);
    double smallest = std::numeric_limits<double>::infinity(), expected_smallest = smallest;
    for (int tick = 0; tick < 200; ++tick) {
      for (int i = 0; i < kThings; ++i) {
        const double move = tick == 100 ? uniform(-20, 20) : uniform(-0.1, 0.1);
        line.middle[i] += move;
        dut.Moved(i, std::abs(move));
      }
      double nearest = std::numeric_limits<double>::infinity();
      for (int pair = 0; pair < static_cast<int>(line.pairs.size()); ++pair)
        nearest = std::min(nearest, line.Distance(pair));
      const double below = tick % 7 == 0 ? uniform(-1, 3) : smallest;
      line.measured = 0;
      const auto found = line.Find(&dut, below);
      measured += line.measured;
      ASSERT_EQ(found.has_value(), nearest < below) << trial << " " << tick;
      if (found) {
        ASSERT_EQ(found->distance, nearest);
        ASSERT_EQ(line.Distance(found->pair), nearest);
        smallest = std::min(smallest, found->distance);
        ++found_any;
      }
      expected_smallest = std::min(expected_smallest, nearest);
      if (tick % 7 != 0) {
        ASSERT_EQ(smallest, expected_smallest);
      }
      expected_smallest = smallest;
      NearestPair forgetful(line.pairs, kThings);
      line.measured = 0;
      line.Find(&forgetful, below);
      measured_without_memory += line.measured;
    }
  }
  EXPECT_GT(found_any, 1000);
  EXPECT_LT(measured, measured_without_memory);
}

TEST(NearestPair, IsFoundAgainAfterAMoveOfUnknownLength) {
  Line line{.middle = {0, 5}, .half = {1, 1}, .pairs = {{0, 1}}};
  NearestPair dut(line.pairs, 2);
  ASSERT_TRUE(line.Find(&dut, 10));
  line.middle[1] = 2.5;
  dut.Forget();
  const auto found = line.Find(&dut, 3);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->distance, 0.5);
}

}  // namespace evalbus::collision::nearest_pair_test
