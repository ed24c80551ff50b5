#include "report/page/page.h"

#include <gtest/gtest.h>

namespace evalbus::report::page_test {

TEST(WithMinus, ReplacesHyphensBeforeNumbersOnly) {
  EXPECT_EQ(WithMinus("-22 points (-38 to -9)"), "−22 points (−38 to −9)");
  EXPECT_EQ(WithMinus("noisy_expert-0.1, 2026-11-26, 1e-3, a - b, --episode 3"),
            "noisy_expert-0.1, 2026-11-26, 1e-3, a - b, --episode 3");
}

TEST(PlayerUrl, LeadsToTheMomentAndTheOtherEpisode) {
  const results::Cause cause{"lost_object", 3.62, "Right gripper lost the pot."};
  EXPECT_EQ(PlayerUrl({1, 3}, cause, PlayerPlace{0, 4}), "#view:run=1,episode=3,t=2.620,other=0/4");
  EXPECT_EQ(PlayerUrl({1, 3}, {"lost_object", 0.5, "x"}), "#view:run=1,episode=3,t=0.000");
  // Runs of older versions have no cause, so the moment is unknown.
  EXPECT_EQ(PlayerUrl({0, 3}, {}), "#view:run=0,episode=3");
}

}  // namespace evalbus::report::page_test
