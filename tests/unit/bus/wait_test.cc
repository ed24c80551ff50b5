#include "bus/wait.h"

#include <gtest/gtest.h>

namespace evalbus::wait_test {

using std::chrono::hours;
using std::chrono::milliseconds;

const Wait::Time kStart{hours(1)};

TEST(Wait, LastsAsLongAsItIsLookedAt) {
  Wait wait(kStart);
  for (int look = 1; look <= 50; ++look)
    EXPECT_EQ(wait.Elapsed(kStart + look * milliseconds(100)), look * milliseconds(100));
  // A second call with the same time does not extend the wait.
  EXPECT_EQ(wait.Elapsed(kStart + milliseconds(5000)), milliseconds(5000));
}

TEST(Wait, APauseIsNoWaiting) {
  Wait wait(kStart);
  EXPECT_EQ(wait.Elapsed(kStart + milliseconds(100)), milliseconds(100));
  EXPECT_EQ(wait.Elapsed(kStart + hours(1)), milliseconds(100) + Wait::kLongestLook);
  EXPECT_EQ(wait.Elapsed(kStart + hours(1) + milliseconds(100)), milliseconds(200) + Wait::kLongestLook);
}

TEST(Wait, TimesThatComeLateTakeNothingAway) {
  Wait wait(kStart);
  wait.Elapsed(kStart + milliseconds(200));
  EXPECT_EQ(wait.Elapsed(kStart), milliseconds(200));
  EXPECT_EQ(wait.Elapsed(kStart + milliseconds(300)), milliseconds(300));
}

}  // namespace evalbus::wait_test
