#include "sim/pacer.h"

#include <gtest/gtest.h>

namespace evalbus::sim::pacer_test {

using std::chrono::milliseconds;

const Pacer::Time kStart{std::chrono::seconds(100)};

TEST(Pacer, TicksAreDueOnePeriodApart) {
  Pacer pacer;
  pacer.Start(kStart, 0.02);
  EXPECT_EQ(pacer.due(), kStart + milliseconds(20));
  pacer.Published(kStart + milliseconds(23));
  EXPECT_EQ(pacer.due(), kStart + milliseconds(40));
  EXPECT_EQ(pacer.late_ticks(), 0);
}

TEST(Pacer, ATickThatIsAWholePeriodLateMovesThoseThatFollow) {
  Pacer pacer;
  pacer.Start(kStart, 0.02);
  pacer.Published(kStart + milliseconds(40));
  EXPECT_EQ(pacer.late_ticks(), 1);
  EXPECT_EQ(pacer.due(), kStart + milliseconds(60));
}

TEST(Pacer, ReportsHowLateTicksWere) {
  Pacer pacer;
  pacer.Start(kStart, 0.02);
  for (const int late_ms : {1, 4, 2, 3}) {
    pacer.Published(pacer.due() + milliseconds(late_ms));
  }
  const time_distribution_t error = pacer.Error();
  EXPECT_EQ(error.count, 4);
  EXPECT_NEAR(error.p50_s, 0.002, 1e-9);
  EXPECT_NEAR(error.p99_s, 0.004, 1e-9);
  EXPECT_NEAR(error.p999_s, 0.004, 1e-9);
  EXPECT_NEAR(error.max_s, 0.004, 1e-9);
  EXPECT_EQ(pacer.late_ticks(), 0);
}

TEST(Pacer, NothingIsCarriedIntoTheNextEpisode) {
  Pacer pacer;
  pacer.Start(kStart, 0.02);
  pacer.Published(kStart + milliseconds(500));
  pacer.Start(kStart + milliseconds(600), 0.02);
  EXPECT_EQ(pacer.late_ticks(), 0);
  EXPECT_EQ(pacer.Error().count, 0);
  EXPECT_EQ(pacer.Error().max_s, 0);
}

}  // namespace evalbus::sim::pacer_test
