// What is written into the picture: task, time, stages, counts, and how the episode ended.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "evalbus/metric_values_t.hpp"
#include "viz/pictures/frame.h"

namespace evalbus::viz {

struct OverlayText {
  std::string title;     // "lift_pot/position"
  std::string subtitle;  // "episode 3, seed 1234"
  double time_s = 0;
  struct Stage {
    std::string name;
    bool reached = false;
  };
  std::vector<Stage> stages;
  // What went wrong on the way, as far as the run counts it: "slips" and how many.
  std::vector<std::pair<std::string, int64_t>> counts;
  // episode_end_t.end_reason; empty while the episode runs.
  std::string end_reason;
};

// "episode 3, seed 1234"; without the seed where it is not known.
std::string EpisodeSubtitle(int32_t episode, std::optional<int64_t> seed);
// Stages and counts of these scores.
void AddScores(const metric_values_t& metrics, OverlayText* text);

class Overlay {
 public:
  // Sizes follow the frame's height. Throws EnvironmentError if the font is missing.
  explicit Overlay(FrameSize size);

  void Draw(const OverlayText& text, Frame* frame) const;

 private:
  double scale_;
};

}  // namespace evalbus::viz
