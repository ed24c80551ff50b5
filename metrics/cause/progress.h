// Tracks how close each condition of a task came to being met, and since when the robot has been at rest.
// Used for the decisive moment.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "evalbus/condition_t.hpp"

namespace evalbus::metrics {

// Best state of a condition in an episode.
struct BestOfCondition {
  // How far (>= 0, in the condition's unit; m for a hold) the condition was from being met; NaN: no measure.
  double gap = NAN;
  double first_gap = NAN;
  // The number that the condition compares, when the gap was smallest, or its extreme value while the gap was
  // 0; NaN if it compares none.
  double value = NAN;
  // Last tick at which the gap fell by at least kStep of the first gap, or at which the condition held.
  int64_t progress_tick = 0;
  bool was_met = false;
};

// Returns how far the condition's number is from being met, >= 0, in the condition's unit.
inline double GapOfNumber(const condition_t& condition) {
  const double above = condition.value_mixed - condition.threshold_mixed;
  return std::max(0.0, condition.comparison == ">=" ? -above : above);
}

class ConditionProgress {
 public:
  static constexpr double kStep = 0.02;

  void Start() { tracks_.clear(); }

  // Adds the state of condition `index` at a tick. distance: the gap of a condition without a number, m; NaN
  // if it has none.
  void Add(size_t index, int64_t tick, const condition_t& condition, double distance) {
    if (index >= tracks_.size()) tracks_.resize(index + 1);
    Track& track = tracks_[index];
    if (condition.holds) {
      track.best.progress_tick = tick;
      track.best.was_met = true;
    }
    const double gap = condition.has_value ? GapOfNumber(condition) : distance;
    if (gap == 0 && track.best.gap == 0 && condition.has_value) {
      double& best = track.best.value;
      best = condition.comparison == ">=" ? std::max(best, condition.value_mixed)
                                          : std::min(best, condition.value_mixed);
    }
    if (!std::isfinite(gap) || gap >= track.best.gap) return;
    if (std::isnan(track.best.gap)) track.best.first_gap = track.mark = gap;
    track.best.gap = gap;
    if (condition.has_value) track.best.value = condition.value_mixed;
    if (gap > track.mark - kStep * track.best.first_gap) return;
    track.mark = gap;
    track.best.progress_tick = tick;
  }

  const BestOfCondition& best(size_t index) const { return tracks_[index].best; }

 private:
  struct Track {
    BestOfCondition best;
    double mark = 0;  // gap at the last progress
  };
  std::vector<Track> tracks_;
};

// Finds the tick since which the robot has been at rest. Positions are compared with the positions at the
// beginning of the rest:
//   - A rest ends when the commanded position of a joint differs by more than kCommand.
//   - During the first kSettled, a rest also ends when the measured position of a joint differs by more than
//     kSag. Smaller changes are ignored, because servos yield to a load. After kSettled, measured positions
//     are ignored, because an object that slides out of a hand moves the arm.
//   - If the commands are unknown, a rest ends when a measured position differs by more than kCommand.
// Only the commands of grippers are compared (fractions of their travel), because grippers yield while an
// object slides in them.
class Rest {
 public:
  static constexpr double kCommand = 0.003;  // rad; for grippers, a fraction of the travel
  static constexpr double kSag = 0.1;        // rad
  static constexpr double kSettled = 1;      // s
  // An arm or a gripper follows its commands with a delay, and is at rest this long (s) after they no longer
  // change.
  static constexpr double kCommandLag = 0.5;

  explicit Rest(double dt) : settled_ticks_(std::llround(kSettled / dt)) {}

  void Start() {
    joints_.clear();
    commands_.clear();
    closings_.clear();
    last_.clear();
    largest_step_ = 0;
    since_ = 0;
  }

  // commands: of the joints. closings: commands of the grippers. Empty if unknown.
  void Add(int64_t tick, std::span<const double> joints, std::span<const double> commands,
           std::span<const double> closings = {}) {
    const std::span<const double> now = commands.empty() ? joints : commands;
    // The commands in the reset state do not come from the policy, so the first commands are the commands of
    // tick 1.
    for (size_t j = 0; tick > 1 && j < last_.size() && j < now.size(); ++j) {
      largest_step_ = std::max(largest_step_, std::abs(now[j] - last_[j]));
    }
    last_.assign(now.begin(), now.end());
    const bool are_known = !commands.empty();
    if (tick == 1) {
      commands_.assign(commands.begin(), commands.end());
      closings_.assign(closings.begin(), closings.end());
    }
    const bool has_settled = are_known && tick > since_ + settled_ticks_;
    if (IsNear(commands, commands_, kCommand) && IsNear(closings, closings_, kCommand) &&
        (has_settled || IsNear(joints, joints_, are_known ? kSag : kCommand)))
      return;
    joints_.assign(joints.begin(), joints.end());
    commands_.assign(commands.begin(), commands.end());
    closings_.assign(closings.begin(), closings.end());
    since_ = tick;
  }

  int64_t since() const { return since_; }
  // Returns the largest change (rad) of a joint's commanded position between two ticks; if commands are
  // unknown, of its measured position.
  double largest_step() const { return largest_step_; }

 private:
  static bool IsNear(std::span<const double> a, std::span<const double> b, double tolerance) {
    return std::ranges::equal(a, b, [&](double x, double y) { return std::abs(x - y) <= tolerance; });
  }

  int64_t settled_ticks_;
  // Values at the beginning of the rest.
  std::vector<double> joints_, commands_, closings_;
  std::vector<double> last_;
  double largest_step_ = 0;
  int64_t since_ = 0;
};

}  // namespace evalbus::metrics
