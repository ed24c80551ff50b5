#include "viz/images/video_timing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/number_from.h"

namespace evalbus::viz {
namespace {

constexpr double kUsPerSecond = 1e6;
constexpr double kSlowest = 0.05, kFastest = 100, kLongestHighlight = 600;

// A part of the video that is shown at one rate. Times are in us of simulated time.
struct Stretch {
  double begin_us, end_us, rate;
};

// Divides [from, end] into stretches. Stretches around the moments have the rate `speed`, and all others are
// faster.
std::vector<Stretch> Stretches(const VideoTiming& timing, double from_us, double end_us) {
  if (timing.highlight_s <= 0) return {{from_us, end_us, timing.speed}};
  std::vector<double> moments = timing.moments_s;
  std::ranges::sort(moments);
  const double fast = timing.speed * kFastForward;
  std::vector<Stretch> stretches;
  double at = from_us;
  for (const double moment_s : moments) {
    const double begin = std::clamp((moment_s - timing.highlight_s / 2) * kUsPerSecond, at, end_us);
    const double end = std::clamp((moment_s + timing.highlight_s / 2) * kUsPerSecond, at, end_us);
    if (begin > at) stretches.push_back({at, begin, fast});
    if (end > begin) stretches.push_back({begin, end, timing.speed});
    at = end;
  }
  if (at < end_us || stretches.empty()) stretches.push_back({at, end_us, fast});
  return stretches;
}

// Parses the whole text as a number of at least 0.
double ReadSeconds(const std::string& text, const std::string& option) {
  const auto seconds = NumberFrom<double>(text);
  if (!seconds || !std::isfinite(*seconds) || *seconds < 0)
    throw InputError(option + ": expected FROM..TO in seconds, for example 2.5..6");
  return *seconds;
}

}  // namespace

void ParseTrim(const std::string& text, VideoTiming* timing) {
  const std::string option = "--trim " + text, dots = "..";
  const size_t at = text.find(dots);
  if (at == std::string::npos || text == dots) ReadSeconds("", option);
  const std::string from = text.substr(0, at), to = text.substr(at + dots.size());
  timing->from_s = from.empty() ? 0 : ReadSeconds(from, option);
  timing->to_s = to.empty() ? std::nullopt : std::optional(ReadSeconds(to, option));
  if (timing->to_s && *timing->to_s <= timing->from_s) {
    throw InputError(option + ": expected FROM to be smaller than TO");
  }
}

void CheckVideoTiming(const VideoTiming& timing) {
  if (!(timing.speed >= kSlowest && timing.speed <= kFastest)) {
    throw InputError(
        fmt::format("--speed {}: expected a number from {} to {}", timing.speed, kSlowest, kFastest));
  }
  if (!(timing.highlight_s >= 0 && timing.highlight_s <= kLongestHighlight)) {
    throw InputError(
        fmt::format("--highlight {}: expected seconds, 0 to {}", timing.highlight_s, kLongestHighlight));
  }
}

std::string NameSuffix(const VideoTiming& timing) {
  VideoTiming rest = timing;
  rest.highlight_s = 0;
  return std::string(timing.highlight_s > 0 ? "_highlight" : "") + (rest == VideoTiming() ? "" : "_clip");
}

std::vector<FrameTime> FrameTimes(const VideoTiming& timing, int64_t end_us) {
  const double from_us = timing.from_s * kUsPerSecond, episode_us = static_cast<double>(end_us);
  const double to_us = timing.to_s ? std::min(*timing.to_s * kUsPerSecond, episode_us) : episode_us;
  if (from_us > episode_us) {
    throw InputError(fmt::format("--trim: the episode ends at {:.2f} s, before {} s",
                                 episode_us / kUsPerSecond, timing.from_s));
  }
  std::vector<FrameTime> frames;
  const std::vector<Stretch> stretches = Stretches(timing, from_us, to_us);
  for (const Stretch& stretch : stretches) {
    const bool is_last = &stretch == &stretches.back();
    for (int n = 0;; ++n) {
      // n * 1e6 / 30 is exact if it is a whole number, so no frame shows the tick before its own tick.
      const double time_us = stretch.begin_us + n * stretch.rate * kUsPerSecond / kVideoRate;
      if (time_us > stretch.end_us || (time_us == stretch.end_us && !is_last)) break;
      frames.push_back({time_us / kUsPerSecond, stretch.rate});
    }
  }
  return frames;
}

std::vector<size_t> VideoSchedule(const std::vector<int64_t>& sim_time_us,
                                  const std::vector<FrameTime>& frames) {
  std::vector<size_t> shown;
  size_t i = 0;
  for (const FrameTime& frame : frames) {
    // Rounds a frame's time down to microseconds. 1e-3 compensates for rounding errors of times that are
    // whole microseconds.
    const auto time_us = static_cast<int64_t>(std::floor(frame.time_s * kUsPerSecond + 1e-3));
    while (i + 1 < sim_time_us.size() && sim_time_us[i + 1] <= time_us) ++i;
    shown.push_back(i);
  }
  return shown;
}

std::string ClockText(const FrameTime& time) {
  const std::string text = fmt::format("{:.2f} s", time.time_s);
  return time.rate == 1 ? text : fmt::format("{}, {:.4g}x", text, time.rate);
}

}  // namespace evalbus::viz
