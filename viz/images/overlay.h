// Text overlay of an image: task, policy and robot, time, stages, counts, and the outcome of the episode.
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
  std::string clock;     // "4.60 s"
  struct Stage {
    std::string name;
    bool reached = false;
  };
  std::vector<Stage> stages;
  // Label and count of each kind of undesired event that the run counts, e.g. "slips" and 2.
  std::vector<std::pair<std::string, int64_t>> counts;
  // Outcome (end_reason::Outcome), or the end reason if the outcome is unknown. Empty while the episode is
  // running.
  std::string end_reason;
};

std::string EpisodeSubtitle(int32_t episode);
// Returns text such as "expert on bimanual_panda", or only the robot if the policy is unknown.
std::string MakerText(const std::string& policy, const std::string& robot);
// Sets the stages and counts of `text` from these metrics.
void AddScores(const metric_values_t& metrics, OverlayText* text);

// kSmall: only time and outcome, for pages that contain the other facts as text.
enum class OverlayAmount { kNone, kSmall, kFull };
// Parses "none", "small" or "full". Throws InputError for other names.
OverlayAmount ParseOverlay(const std::string& name);

class Overlay {
 public:
  // Sizes scale with the frame's height. Throws EnvironmentError if the font is missing.
  explicit Overlay(FrameSize size, OverlayAmount amount = OverlayAmount::kFull);

  void Draw(const OverlayText& text, Frame* frame) const;

 private:
  double scale_;
  OverlayAmount amount_;
};

}  // namespace evalbus::viz
