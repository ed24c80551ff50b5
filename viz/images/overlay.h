// What is written into the image: task, policy and robot, time, stages, counts, and how the episode ended.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "evalbus/metric_values_t.hpp"
#include "viz/images/frame.h"

namespace evalbus::viz {

struct OverlayText {
  std::string title;     // "lift_pot/position"
  std::string subtitle;  // "episode 3"
  std::string maker;     // "expert on bimanual_panda"
  double time_s = 0;
  struct Stage {
    std::string name;
    bool reached = false;
  };
  std::vector<Stage> stages;
  // What went wrong on the way, as far as the run counts it: "slips" and how many.
  std::vector<std::pair<std::string, int64_t>> counts;
  // How it came out (end_reason::Outcome), or what ended it where that is not known; empty while the episode
  // runs.
  std::string end_reason;
};

std::string EpisodeSubtitle(int32_t episode);
// "expert on bimanual_panda"; without the policy where it is not known.
std::string MakerText(const std::string& policy, const std::string& robot);
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
