// Which part of an episode a video shows, and how fast. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace evalbus::viz {

inline constexpr int kVideoRate = 30;  // frames per second of video
// Factor by which everything outside of a highlight is faster.
inline constexpr double kFastForward = 8;

struct VideoTiming {
  // Simulated seconds per second of video.
  double speed = 1;
  // Simulated time of the first and the last frame, s; without to_s, the video shows the episode's end.
  double from_s = 0;
  std::optional<double> to_s;
  // Length of the part around each decisive moment that is shown at `speed`, s; 0: everything is shown at it.
  double highlight_s = 0;
  // Decisive moments, s. Empty: that of the episode.
  std::vector<double> moments_s;

  bool operator==(const VideoTiming&) const = default;
};

// Parses "FROM..TO", "FROM.." or "..TO", in seconds. Throws InputError.
void ParseTrim(const std::string& text, VideoTiming* timing);
// Throws InputError for a speed or a highlight out of range.
void CheckVideoTiming(const VideoTiming& timing);
// Part of a video's file name that distinguishes it from the video of the whole episode: "" for that one,
// "_highlight" or "_clip".
std::string NameSuffix(const VideoTiming& timing);

struct FrameTime {
  double time_s;
  // Simulated seconds per second of video at this frame.
  double rate;
};

// Returns the time of each frame of a video of an episode that lasts end_us. Between an episode's start and
// its end, frame n shows n / kVideoRate s times the rate. If two episodes are timed with the same moments,
// the times of the shorter one are the first of the longer one's. Throws InputError if the episode ends
// before from_s.
std::vector<FrameTime> FrameTimes(const VideoTiming& timing, int64_t end_us);

// Returns, for each frame, the index of the last time at or before the frame's. sim_time_us: increasing.
std::vector<size_t> VideoSchedule(const std::vector<int64_t>& sim_time_us,
                                  const std::vector<FrameTime>& frames);

// For example "4.60 s", and "4.60 s, 8x" if the rate is not 1.
std::string ClockText(const FrameTime& time);

}  // namespace evalbus::viz
