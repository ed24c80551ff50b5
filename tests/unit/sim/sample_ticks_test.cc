#include "sim/sample_ticks.h"

#include <gmock/gmock.h>

namespace evalbus::sim::sample_ticks_test {

using testing::ElementsAre;

// Number and time, in ms, of each tick that these samples (ms) give, 20 ms apart; -1: a sample that was
// refused.
std::vector<std::pair<int64_t, double>> TicksOf(const std::vector<double>& samples_ms, int* gaps = nullptr,
                                                bool* is_broken = nullptr) {
  SampleTicks ticks(0.02, 0.02);
  std::vector<std::pair<int64_t, double>> found;
  bool refused = false;
  for (const double time : samples_ms) {
    if (time < 0) {
      refused = true;
      continue;
    }
    Sample sample;
    sample.time_s = time / 1e3;
    ticks.Add(sample, std::exchange(refused, false));
    while (const auto tick = ticks.Next()) {
      const double at = tick->before->time_s + tick->share * (tick->behind->time_s - tick->before->time_s);
      found.emplace_back(tick->number, std::round(at * 1e9) / 1e6);
    }
  }
  if (gaps) *gaps = ticks.gaps();
  if (is_broken) *is_broken = ticks.is_broken() || refused;
  return found;
}

TEST(SampleTicks, LieBetweenTheirNeighbours) {
  EXPECT_THAT(TicksOf({0, 10, 25, 40, 59}), ElementsAre(std::pair(0, 0), std::pair(1, 20), std::pair(2, 40)));
}

TEST(SampleTicks, OnASampleAreThatSample) {
  SampleTicks ticks(0.02, 0.02);
  for (int i = 0; i < 3; ++i) {
    Sample sample;
    sample.time_s = i * 0.02;
    ticks.Add(sample);
  }
  for (int64_t i = 0; i < 3; ++i) {
    const auto tick = ticks.Next();
    ASSERT_TRUE(tick);
    EXPECT_EQ(tick->number, i);
    EXPECT_EQ(tick->before, tick->behind);
  }
  EXPECT_FALSE(ticks.Next());
}

TEST(SampleTicks, ComeOfRareSamplesAsOftenAsTheRuleAllows) {
  // 60 ms is three ticks, and no gap.
  EXPECT_EQ(TicksOf({0, 60}).size(), 4u);
}

TEST(SampleTicks, AreMissingInAGap) {
  int gaps = 0;
  // 20 to 81 ms is more than three ticks: 40, 60 and 80 are missing.
  EXPECT_THAT(TicksOf({0, 20, 81, 101}, &gaps),
              ElementsAre(std::pair(0, 0), std::pair(1, 20), std::pair(5, 100)));
  EXPECT_EQ(gaps, 1);
  // A sample at its end that is on a tick is there.
  EXPECT_THAT(TicksOf({0, 20, 100}, &gaps),
              ElementsAre(std::pair(0, 0), std::pair(1, 20), std::pair(5, 100)));
}

TEST(SampleTicks, TheOneBehindARefusedSampleIsMissing) {
  bool is_broken = true;
  EXPECT_THAT(TicksOf({0, 5, -1, 15, 20, 25, 40, 45}, nullptr, &is_broken),
              ElementsAre(std::pair(0, 0), std::pair(2, 40)));
  EXPECT_FALSE(is_broken);
  // Of a first one that was refused: the second tick, since there is no first one without it.
  EXPECT_THAT(TicksOf({-1, 0, 20, 40}), ElementsAre(std::pair(0, 0), std::pair(2, 40)));
  // It has not cost a tick yet.
  TicksOf({0, 5, -1, 15}, nullptr, &is_broken);
  EXPECT_TRUE(is_broken);
}

TEST(SampleTicks, AnHourOfNothingTakesNoTime) {
  EXPECT_THAT(TicksOf({0, 3.6e15}), ElementsAre(std::pair(0, 0), std::pair(180'000'000'000'000, 3.6e15)));
}

}  // namespace evalbus::sim::sample_ticks_test
