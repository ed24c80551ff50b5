// Finds the contacts of the robot, and its grips, that exceed the force limits of the run (docs/limits.md).
// Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "evalbus/limit_violation_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/force_limits.h"
#include "models/model_names.h"

namespace evalbus::metrics {

// Checks at every tick each pair of a region's body and a robot body, using the largest contact force of a
// physics step, and each gripper, using its largest grip force. Interruptions of a contact or a violation
// that are shorter than kSeparationTime are ignored.
class LimitChecker {
 public:
  // Uses the limits in MODEL (limits_yaml); without them, nothing is checked. `names` must outlive this
  // object. Throws InputError.
  explicit LimitChecker(const ModelNames& names);

  bool has_limits() const { return !regions_.empty(); }
  void Start();
  // Adds the next tick.
  void Add(const state_t& state);
  // Returns whether a region has a limit of the grip force.
  bool has_grip_limits() const;
  // Return the largest excess of a grip force over its limit so far, N, and the number of ticks with an
  // excess. Both are 0 if no limit was exceeded.
  double largest_squeeze() const { return largest_squeeze_; }
  int64_t squeeze_ticks() const { return squeeze_ticks_; }
  // Returns all violations so far, in chronological order.
  const std::vector<limit_violation_t>& violations() const { return violations_; }

 private:
  struct Region {
    ForceLimit limit;
    std::vector<uint8_t> has_body;  // by body
  };
  // Index of the latest violation of a contact or grip (-1: none), and the last tick at which the force
  // exceeded the limit.
  struct Latest {
    int violation = -1;
    int64_t last_tick = 0;
  };
  // Contact of a robot body with a body of a region.
  struct Touch {
    size_t region;
    int body, robot_body;
    int64_t first_tick, last_tick;
    Latest latest = {};
  };

  void AddTouch(size_t region, int body, int robot_body, double force, int64_t tick);
  // Adds the grips of a tick.
  void AddGrips(const state_t& state);
  // Returns the manipulated object on which all fingers of the gripper press; -1 if there is none. The grip
  // force on an object is the mean force of the finger that presses least. Of several objects, returns the
  // one with the largest grip force.
  int GrippedObject(size_t gripper, const state_t& state) const;
  // Adds a violation, or continues the latest one.
  void Report(limit_violation_t violation, Latest* latest);
  Touch& Find(size_t region, int body, int robot_body, int64_t tick);

  const model_info_t& model_;
  double dt_;
  std::vector<Region> regions_;
  std::vector<uint8_t> is_robot_;  // by body
  std::vector<Touch> touches_;
  std::vector<std::vector<int>> finger_bodies_;  // bodies of each gripper's pads
  std::vector<Latest> grips_;                    // [region * number of grippers + gripper]
  double largest_squeeze_ = 0;
  int64_t squeeze_ticks_ = 0;
  std::vector<limit_violation_t> violations_;
};

}  // namespace evalbus::metrics
