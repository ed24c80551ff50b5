#include "bus/patience.h"

#include <gtest/gtest.h>

namespace evalbus::patience_test {

using std::chrono::milliseconds;

TEST(Patience, GrowsWithTheEpisodeUpToItsBound) {
  const Patience::Time begin{std::chrono::hours(5)};
  Patience patience;
  patience.Begin(begin);
  EXPECT_EQ(patience.At(begin), milliseconds(0));
  EXPECT_EQ(patience.At(begin + milliseconds(16)), milliseconds(1));
  EXPECT_EQ(patience.At(begin + milliseconds(1000)), Patience::kLongest);
  patience.Begin(begin + milliseconds(1000));
  EXPECT_EQ(patience.At(begin + milliseconds(1032)), milliseconds(2));
}

}  // namespace evalbus::patience_test
