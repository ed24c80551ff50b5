// Timing of a video: the part of an episode that it shows, and its speed. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace evalbus::viz {

inline constexpr int kVideoRate = 30;  // frames per second of video
// Factor by which the parts outside highlights are faster.
inline constexpr double kFastForward = 8;

struct VideoTiming {
  // Number of simulated seconds per second of video.
  double speed = 1;
  // Simulated time of the first and the last frame, s. If to_s is unset, the video shows the episode's end.
  double from_s = 0;
  std::optional<double> to_s;
  // Length of the part around each decisive moment that is shown at `speed`, s. 0: the whole video has this
  // speed.
  double highlight_s = 0;
  // Decisive moments, s. Empty: the decisive moment of the episode.
  std::vector<double> moments_s;

  bool operator==(const VideoTiming&) const = default;
};

// Parses "FROM..TO", "FROM.." or "..TO", in seconds. Throws InputError.
void ParseTrim(const std::string& text, VideoTiming* timing);
// Throws InputError if the speed or the length of a highlight is out of range.
void CheckVideoTiming(const VideoTiming& timing);
// Returns the part of a video's file name that depends on its timing: "" for the video of the whole episode,
// otherwise "_highlight" or "_clip".
std::string NameSuffix(const VideoTiming& timing);

struct FrameTime {
  double time_s;
  // Number of simulated seconds per second of video at this frame.
  double rate;
};

// Returns the time of each frame of a video of an episode that lasts end_us. Within a part of constant rate,
// frame n shows the time n / kVideoRate s * rate after the beginning of the part. If two episodes have the
// same decisive moments, the times of the shorter episode are the first times of the longer one. Throws
// InputError if the episode ends before from_s.
std::vector<FrameTime> FrameTimes(const VideoTiming& timing, int64_t end_us);

// Returns, for each frame, the index of the last element of sim_time_us at or before the frame's time.
// sim_time_us must be increasing.
std::vector<size_t> VideoSchedule(const std::vector<int64_t>& sim_time_us,
                                  const std::vector<FrameTime>& frames);

// Returns text such as "4.60 s", or "4.60 s, 8x" if the rate is not 1.
std::string ClockText(const FrameTime& time);

}  // namespace evalbus::viz
