#include "sim/sample_ticks.h"

#include <gmock/gmock.h>

#include "lcmtypes/clock.h"

namespace evalbus::sim::sample_ticks_test {

using testing::ElementsAre;

// Returns number and time, in ms, of each tick that results from these samples (ms) at a control period of 20
// ms. -1 stands for a rejected sample.
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

TEST(SampleTicks, LieBetweenTheirNeighbors) {
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

// The clock of a source at 30 Hz has whole microseconds: 0, 33333, 66667, 100000, ...
TEST(SampleTicks, OfThirtyHzAreTheSamplesThemselvesForAnHour) {
  SampleTicks ticks(1.0 / 30, 1.0 / 30);
  for (int64_t i = 0; i < 30 * 3600; ++i) {
    Sample sample;
    sample.time_s = static_cast<double>(std::llround(static_cast<double>(i) * 1e6 / 30)) / 1e6;
    ticks.Add(sample);
    const auto tick = ticks.Next();
    ASSERT_TRUE(tick) << i;
    ASSERT_EQ(tick->number, i);
    ASSERT_EQ(tick->before, tick->behind) << i;
    ASSERT_EQ(tick->before->time_s, sample.time_s) << i;
  }
  EXPECT_EQ(ticks.gaps(), 0);
}

TEST(SourceRate, IsTheOneWithTheFewestDecimals) {
  EXPECT_EQ(SourceHz(20'000), 50);
  EXPECT_EQ(SourceHz(33'333), 30);
  EXPECT_EQ(SourceHz(16'667), 60);
  EXPECT_EQ(SourceHz(16'683), 59.94);
  EXPECT_EQ(SourceHz(7'813), 128);
  EXPECT_EQ(SourceHz(8'333), 120);
  for (int hz = 5; hz <= 500; ++hz) EXPECT_EQ(SourceHz(std::llround(1e6 / hz)), hz);
}

TEST(SourceRate, TicksDoNotDrift) {
  model_info_t model{};
  model.clock = clock_name::kSource;
  model.timestep_us = 33'333;
  model.substeps = 1;
  const double period_s = ControlPeriod(model);
  EXPECT_EQ(TickUs(1, period_s), 33'333);
  EXPECT_EQ(TickUs(2, period_s), 66'667);
  EXPECT_EQ(TickUs(3, period_s), 100'000);
  EXPECT_EQ(TickUs(30 * 3600, period_s), 3'600'000'000);
  model.clock = clock_name::kLockstep;
  EXPECT_EQ(TickUs(3, ControlPeriod(model)), 99'999) << "physics steps are what they are";
}

TEST(SampleTicks, ComeOfRareSamplesAsOftenAsTheRuleAllows) {
  // 60 ms are three ticks, which is not a gap.
  EXPECT_EQ(TicksOf({0, 60}).size(), 4u);
}

TEST(SampleTicks, AreMissingInAGap) {
  int gaps = 0;
  // From 20 to 81 ms are more than three ticks, so the ticks at 40, 60 and 80 ms are missing.
  EXPECT_THAT(TicksOf({0, 20, 81, 101}, &gaps),
              ElementsAre(std::pair(0, 0), std::pair(1, 20), std::pair(5, 100)));
  EXPECT_EQ(gaps, 1);
  // If the last sample is exactly on a tick, this tick exists.
  EXPECT_THAT(TicksOf({0, 20, 100}, &gaps),
              ElementsAre(std::pair(0, 0), std::pair(1, 20), std::pair(5, 100)));
}

TEST(SampleTicks, GapsWithoutALostOrRefusedSampleAreSparse) {
  SampleTicks ticks(0.02, 0.02);
  const auto add = [&](double time_s, bool after_refused = false, bool after_lost = false) {
    Sample sample;
    sample.time_s = time_s;
    ticks.Add(sample, after_refused, after_lost);
    while (ticks.Next()) {
    }
  };
  for (const double time_s : {0.0, 0.02, 0.04}) add(time_s);
  EXPECT_EQ(ticks.sparse().pairs, 0);
  add(0.24);
  add(0.34);
  add(0.64, true);
  add(0.94, false, true);
  EXPECT_EQ(ticks.gaps(), 4);
  EXPECT_EQ(ticks.sparse().pairs, 2) << "the other two have a reason";
  EXPECT_NEAR(ticks.sparse().shortest_s, 0.1, 1e-12);
  EXPECT_NEAR(ticks.sparse().longest_s, 0.2, 1e-12);
}

TEST(SampleTicks, TheOneBehindARefusedSampleIsMissing) {
  bool is_broken = true;
  EXPECT_THAT(TicksOf({0, 5, -1, 15, 20, 25, 40, 45}, nullptr, &is_broken),
              ElementsAre(std::pair(0, 0), std::pair(2, 40)));
  EXPECT_FALSE(is_broken);
  // If the first sample was rejected, ticks start at the second one.
  EXPECT_THAT(TicksOf({-1, 0, 20, 40}), ElementsAre(std::pair(0, 0), std::pair(2, 40)));
  // No tick has been dropped for the rejected sample yet.
  TicksOf({0, 5, -1, 15}, nullptr, &is_broken);
  EXPECT_TRUE(is_broken);
}

TEST(SampleTicks, AnHourOfNothingTakesNoTime) {
  EXPECT_THAT(TicksOf({0, 3.6e15}), ElementsAre(std::pair(0, 0), std::pair(180'000'000'000'000, 3.6e15)));
}

}  // namespace evalbus::sim::sample_ticks_test
