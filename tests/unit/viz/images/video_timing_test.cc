// Tests the times of a video's frames, computed by hand at 30 frames per second.
#include "viz/images/video_timing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "base/errors.h"

namespace evalbus::viz::video_timing_test {

VideoTiming Trimmed(const std::string& text) {
  VideoTiming timing;
  ParseTrim(text, &timing);
  return timing;
}

std::string ErrorText(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "(no error)";
}

TEST(VideoTiming, SpeedScalesTheTimeBetweenFrames) {
  VideoTiming timing;
  timing.speed = 2;
  // 2 s at twice the speed have frames at 0, 2/30, ... 2 s.
  const auto frames = FrameTimes(timing, 2000000);
  ASSERT_EQ(frames.size(), 31u);
  EXPECT_DOUBLE_EQ(frames[1].time_s, 2 / 30.);
  EXPECT_DOUBLE_EQ(frames[30].time_s, 2);
  EXPECT_EQ(frames[30].rate, 2);
  EXPECT_EQ(ClockText(frames[30]), "2.00 s, 2x");
  EXPECT_EQ(ClockText({4.6, 1}), "4.60 s");
}

TEST(VideoTiming, TrimLimitsTheFrames) {
  const auto frames = FrameTimes(Trimmed("1..1.5"), 2000000);
  ASSERT_EQ(frames.size(), 16u);
  EXPECT_DOUBLE_EQ(frames.front().time_s, 1);
  EXPECT_DOUBLE_EQ(frames.back().time_s, 1.5);
  EXPECT_EQ(FrameTimes(Trimmed("..0.5"), 2000000).size(), 16u);
  EXPECT_EQ(FrameTimes(Trimmed("1.5.."), 2000000).size(), 16u);
  // An end that is later than the episode's end is replaced by it.
  EXPECT_EQ(FrameTimes(Trimmed("1.5..9"), 2000000).size(), 16u);
}

TEST(VideoTiming, HighlightIsSlowAndTheRestFast) {
  VideoTiming timing;
  timing.highlight_s = 2;
  timing.moments_s = {10};
  // The episode lasts 20 s. 9 s at 8x are 33.75 frames, so 34 begin before 9 s. 2 s at 1x are 60 frames, and
  // the last 9 s at 8x are 34.
  const auto frames = FrameTimes(timing, 20000000);
  ASSERT_EQ(frames.size(), 34u + 60 + 34);
  EXPECT_DOUBLE_EQ(frames[1].time_s, 8 / 30.);
  EXPECT_DOUBLE_EQ(frames[34].time_s, 9);
  EXPECT_EQ(frames[33].rate, kFastForward);
  EXPECT_EQ(frames[34].rate, 1);
  EXPECT_DOUBLE_EQ(frames[93].time_s, 9 + 59 / 30.);
  EXPECT_DOUBLE_EQ(frames[94].time_s, 11);
  EXPECT_EQ(frames[94].rate, kFastForward);
  EXPECT_TRUE(std::ranges::is_sorted(frames, {}, &FrameTime::time_s));
}

TEST(VideoTiming, ShorterEpisodeHasTheFirstFramesOfALongerOne) {
  VideoTiming timing;
  timing.highlight_s = 3;
  timing.moments_s = {5.1, 4.2};
  const auto longer = FrameTimes(timing, 20000000);
  for (const int64_t end_us : {500000, 3000000, 4300000, 6600000, 7000000}) {
    const auto shorter = FrameTimes(timing, end_us);
    ASSERT_LE(shorter.size(), longer.size());
    for (size_t n = 0; n < shorter.size(); ++n) {
      ASSERT_EQ(shorter[n].time_s, longer[n].time_s) << end_us << " frame " << n;
    }
  }
}

TEST(VideoTiming, ChangedTimingChangesTheFileName) {
  EXPECT_EQ(NameSuffix({}), "");
  EXPECT_EQ(NameSuffix(Trimmed("1..2")), "_clip");
  VideoTiming timing;
  timing.highlight_s = 3;
  EXPECT_EQ(NameSuffix(timing), "_highlight");
  timing.to_s = 2;
  EXPECT_EQ(NameSuffix(timing), "_highlight_clip");
}

TEST(VideoTiming, BadValuesAreRefused) {
  for (const std::string text : {"", "..", "3", "a..b", "1..2s", "-1..2"}) {
    EXPECT_EQ(ErrorText([&] { Trimmed(text); }),
              "--trim " + text + ": expected FROM..TO in seconds, for example 2.5..6");
  }
  EXPECT_EQ(ErrorText([] { Trimmed("3..2"); }), "--trim 3..2: expected FROM to be smaller than TO");
  EXPECT_EQ(ErrorText([] { FrameTimes(Trimmed("3..4"), 2000000); }),
            "--trim: the episode ends at 2.00 s, before 3 s");
  VideoTiming timing;
  timing.speed = 0;
  EXPECT_EQ(ErrorText([&] { CheckVideoTiming(timing); }), "--speed 0: expected a number from 0.05 to 100");
  timing = {};
  timing.highlight_s = -1;
  EXPECT_EQ(ErrorText([&] { CheckVideoTiming(timing); }), "--highlight -1: expected seconds, 0 to 600");
}

}  // namespace evalbus::viz::video_timing_test
