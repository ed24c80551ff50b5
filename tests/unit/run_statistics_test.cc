#include "metrics/run_statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace evalbus {
namespace {

EpisodeResult Episode(bool complete, bool success, nlohmann::ordered_json metrics) {
  return {.complete = complete, .success = success, .metrics = std::move(metrics)};
}

TEST(Summarize, CountsOnlyCompleteEpisodes) {
  const run_summary_t summary = Summarize({
      Episode(true, true, {{"path", {{"left", 1.0}, {"right", 5}}}, {"reached", true}}),
      Episode(true, false, {{"path", {{"left", 2.0}, {"right", 5}}}, {"reached", false}}),
      Episode(true, true, {{"path", {{"left", 6.0}, {"right", 5}}}, {"reached", true}, {"error", 0.5}}),
      Episode(false, true, {{"path", {{"left", 1000.0}, {"right", 1000}}}}),
      Episode(true, true, {{"path", {{"left", 3.0}, {"right", 5}}}, {"reached", true}}),
  });

  EXPECT_EQ(summary.num_episodes, 5);
  EXPECT_EQ(summary.num_complete, 4);
  EXPECT_EQ(summary.num_success, 3);
  EXPECT_EQ(summary.success_rate, 0.75);
  ASSERT_EQ(summary.metric_name, (std::vector<std::string>{"path.left", "path.right", "reached", "error"}));
  ASSERT_EQ(summary.num_metrics, 4);
  EXPECT_EQ(summary.mean_mixed, (std::vector<double>{3, 5, 0.75, 0.5}));
  EXPECT_NEAR(summary.std_mixed[0], std::sqrt((4 + 1 + 0 + 9) / 3.0), 1e-15);
  EXPECT_EQ(summary.std_mixed[1], 0);
  EXPECT_EQ(summary.std_mixed[2], 0.5);
  EXPECT_TRUE(std::isnan(summary.std_mixed[3]));
  EXPECT_EQ(summary.median_mixed, (std::vector<double>{2.5, 5, 1, 0.5}));
  EXPECT_EQ(summary.min_mixed, (std::vector<double>{1, 5, 0, 0.5}));
  EXPECT_EQ(summary.max_mixed, (std::vector<double>{6, 5, 1, 0.5}));
}

TEST(Summarize, OfNothingHasNoRate) {
  const run_summary_t summary = Summarize({Episode(false, true, {})});

  EXPECT_EQ(summary.num_episodes, 1);
  EXPECT_EQ(summary.num_complete, 0);
  EXPECT_TRUE(std::isnan(summary.success_rate));
  EXPECT_EQ(summary.success_rate_lower, 0);
  EXPECT_EQ(summary.success_rate_upper, 1);
}

}  // namespace
}  // namespace evalbus
