// Content of the panels of an episode's video, computed from its log. Pure.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "bus/episode_reader.h"
#include "viz/watch/score_rows.h"

namespace evalbus::viz {

// A metric over time: one line per arm, or a single line.
struct VideoCurve {
  std::string label;
  std::string unit;  // unit of the values; may be empty
  std::vector<std::string> of;
  // Values as [line][sample]; NaN if unavailable.
  std::vector<std::vector<double>> value;
  // Range of all values and 0.
  double lowest = 0, highest = 0;
};

// A mark on the timeline.
struct VideoMark {
  enum class Kind { kStage, kGrasp, kSlip, kCollision };
  Kind kind = Kind::kStage;
  double time_s = 0;
  // Only grasps have a duration.
  double duration_s = 0;
};

// A mark in the image at a point in the world frame.
struct PlaceMark {
  // kGrasp stands for a desired contact between robot and object.
  VideoMark::Kind kind = VideoMark::Kind::kGrasp;
  double position_m[3] = {};
};

struct VideoFacts {
  std::string task;   // "lift_pot/position"
  std::string maker;  // "expert on bimanual_panda"
  int episode = 0;
  // Time of the last STATE.
  double duration_s = 0;
  // Stages at the end of the episode, with the times at which they were reached.
  std::vector<StageRow> stages;
  // Sample times of all curves, s.
  std::vector<double> time_s;
  std::vector<VideoCurve> curves;
  // Marks, sorted by time.
  std::vector<VideoMark> marks;
  bool counts_slips = false, counts_collisions = false;
  // Marks in the image, for each frame of the schedule.
  std::vector<std::vector<PlaceMark>> places;
  // Outcome of the episode; empty if the log lacks the episode's end.
  std::string outcome;
  bool success = false;
  // Time of the cause of the outcome or, if there is no cause, of the end, s.
  double outcome_s = 0;
  // Explanation of the outcome; may be empty.
  std::string reason;
  // Name and value with unit of the main metrics.
  std::vector<std::pair<std::string, std::string>> numbers;
};

// schedule: index of the STATE that each frame shows (video_timing.h). Throws InputError if MODEL is
// inconsistent.
VideoFacts FactsOf(const EpisodeMessages& episode, const std::vector<size_t>& schedule,
                   const std::string& policy);

}  // namespace evalbus::viz
