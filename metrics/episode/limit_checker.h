// Finds the contacts of the robot that exceed the force limits of the run (docs/limits.md). Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "evalbus/limit_violation_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/force_limits.h"
#include "models/model_names.h"

namespace evalbus::metrics {

// Checks every pair of a body of a region and a body of the robot at every tick, by the largest force of a
// physics step. A contact that does not touch, or a violation that does not exceed its limit, for less than
// kSeparationTime continues.
class LimitChecker {
 public:
  // Uses the limits in MODEL (limits_yaml); without them, nothing is checked. `names` must outlive this
  // object. Throws InputError.
  explicit LimitChecker(const ModelNames& names);

  bool has_limits() const { return !regions_.empty(); }
  void Start();
  // Adds the next tick.
  void Add(const state_t& state);
  // In chronological order.
  const std::vector<limit_violation_t>& violations() const { return violations_; }

 private:
  struct Region {
    ForceLimit limit;
    std::vector<uint8_t> has_body;  // by body
  };
  // Contact of a robot body with a body of a region.
  struct Touch {
    size_t region;
    int body, robot_body;
    int64_t first_tick, last_tick;
    // Index of its latest violation, -1: none; and the last tick at which it exceeded the limit.
    int violation = -1;
    int64_t last_violation_tick = 0;
  };

  void AddTouch(size_t region, int body, int robot_body, double force, int64_t tick);
  Touch& Find(size_t region, int body, int robot_body, int64_t tick);

  const model_info_t& model_;
  double dt_;
  std::vector<Region> regions_;
  std::vector<uint8_t> is_robot_;  // by body
  std::vector<Touch> touches_;
  std::vector<limit_violation_t> violations_;
};

}  // namespace evalbus::metrics
