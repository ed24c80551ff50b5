// What the videos with panels say of an episode, taken from its log. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "viz/images/recorded_episode.h"
#include "viz/watch/score_rows.h"

namespace evalbus::viz {

// How a score grew: one line for each arm, or a single one.
struct VideoCurve {
  std::string label;
  std::string unit;  // of the values; may be empty
  std::vector<std::string> of;
  // [line][sample], NaN where there is none.
  std::vector<std::vector<double>> value;
  // Of all values.
  double lowest = 0, highest = 0;
};

// On the time line.
struct VideoMark {
  enum class Kind { kStage, kGrasp, kSlip, kCollision };
  Kind kind = Kind::kStage;
  double time_s = 0;
  // A grasp lasts; others have no duration.
  double duration_s = 0;
};

// In the image, at a point of the world.
struct PlaceMark {
  // kGrasp: a contact that is wanted, of the robot with an object.
  VideoMark::Kind kind = VideoMark::Kind::kGrasp;
  double position_m[3] = {};
};

struct VideoFacts {
  std::string task;   // "lift_pot/position"
  std::string maker;  // "expert on bimanual_panda"
  int episode = 0;
  // Time of the last STATE.
  double duration_s = 0;
  // As the episode left them, by which each moment is known.
  std::vector<StageRow> stages;
  // Of the samples of all curves.
  std::vector<double> time_s;
  std::vector<VideoCurve> curves;
  // In order of time.
  std::vector<VideoMark> marks;
  bool counts_slips = false, counts_collisions = false;
  // By frame of the schedule.
  std::vector<std::vector<PlaceMark>> places;
  // Empty for a log without the episode's end.
  std::string outcome;
  bool success = false;
  // Why, for people; may be empty.
  std::string reason;
  // The main numbers, with unit.
  std::vector<std::pair<std::string, std::string>> numbers;
};

// schedule: which STATE each frame shows (VideoSchedule). Throws InputError for a MODEL that contradicts
// itself.
VideoFacts FactsOf(const RecordedEpisode& episode, const std::vector<size_t>& schedule,
                   const std::string& policy);

}  // namespace evalbus::viz
