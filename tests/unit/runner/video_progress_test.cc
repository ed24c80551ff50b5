#include "runner/video_progress.h"

#include <gtest/gtest.h>

namespace evalbus::runner::video_progress_test {

using std::chrono::seconds;

TEST(VideoProgress, PrintsShareAndRemainingTime) {
  const VideoProgress::Time began{seconds(1000)};
  const VideoProgress progress(4, 0, began);
  EXPECT_EQ(progress.Text(0, began), "recording video of 4 episodes: 0 %");
  EXPECT_EQ(progress.Text(0.05, began + seconds(2)), "recording video of 4 episodes: 1 %")
      << "no estimate of the remaining time yet";
  // A quarter is done after 20 s.
  EXPECT_EQ(progress.Text(1, began + seconds(20)), "recording video of 4 episodes: 25 %, 1:00 min left");
  EXPECT_EQ(progress.Text(4, began + seconds(80)), "recording video of 4 episodes: 100 %, 0 s left");
  EXPECT_EQ(VideoProgress(1, 0, began).Text(0.5, began + seconds(7)),
            "recording video of 1 episode: 50 %, 7 s left");
}

// The remaining time follows from the work since the first measurement, because the time of earlier work is
// unknown.
TEST(VideoProgress, CountsFromWhereItBegan) {
  const VideoProgress::Time began{seconds(1000)};
  EXPECT_EQ(VideoProgress(2, 0.5, began).Text(1, began + seconds(10)),
            "recording video of 2 episodes: 50 %, 20 s left");
}

}  // namespace evalbus::runner::video_progress_test
