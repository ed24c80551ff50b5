#include "bus/batch_delay.h"

#include <gtest/gtest.h>

namespace evalbus::batch_delay_test {

using std::chrono::milliseconds;

TEST(BatchDelay, GrowsWithTheEpisodeUpToItsBound) {
  const BatchDelay::Time begin{std::chrono::hours(5)};
  BatchDelay batch_delay;
  batch_delay.Begin(begin);
  EXPECT_EQ(batch_delay.At(begin), milliseconds(0));
  EXPECT_EQ(batch_delay.At(begin + milliseconds(16)), milliseconds(1));
  EXPECT_EQ(batch_delay.At(begin + milliseconds(1000)), BatchDelay::kLongest);
  batch_delay.Begin(begin + milliseconds(1000));
  EXPECT_EQ(batch_delay.At(begin + milliseconds(1032)), milliseconds(2));
}

}  // namespace evalbus::batch_delay_test
