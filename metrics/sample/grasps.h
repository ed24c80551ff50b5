// Finds grasps, in which pads of both fingers of a gripper touch an object. Defined by evalbus
// (docs/metrics.md).
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "metrics/sample/metrics_config.h"
#include "metrics/sample/separation.h"

namespace evalbus::metrics {

// A grasp of an object by a gripper begins at the first sample in which pads of both fingers touch the
// object. It ends at the last such sample before an interruption of at least kSeparationTime.
struct GraspInterval {
  int object;
  int gripper;
  int64_t first_tick;
  int64_t last_tick;

  // Returns the number of ticks from the first to the last, both included.
  int64_t ticks() const { return last_tick - first_tick + 1; }
};

class Grasps {
 public:
  explicit Grasps(const MetricsConfig& config)
      : grippers_(config.grippers.size()),
        dt_(config.control_dt),
        current_(config.objects.size() * grippers_) {
    grasps_.reserve(256);
    Start();
  }

  void Start() {
    grasps_.clear();
    current_.assign(current_.size(), -1);
  }

  // `pinched` is indexed [object * grippers + gripper]; empty if unknown.
  void Add(int64_t tick, std::span<const uint8_t> pinched) {
    for (size_t pair = 0; pair < pinched.size(); ++pair) {
      if (!pinched[pair]) continue;
      int& index = current_[pair];
      if (index < 0 || Separated(grasps_[index].last_tick, tick, dt_)) {
        index = static_cast<int>(grasps_.size());
        grasps_.push_back(
            {static_cast<int>(pair / grippers_), static_cast<int>(pair % grippers_), tick, tick});
      }
      grasps_[index].last_tick = tick;
    }
  }

  // Returns the number of grasps by this gripper in which it grasped an object again.
  int64_t Regrasps(int gripper) const {
    int64_t again = 0;
    for (auto grasp = grasps_.begin(); grasp != grasps_.end(); ++grasp) {
      again +=
          grasp->gripper == gripper && std::any_of(grasps_.begin(), grasp, [&](const GraspInterval& past) {
            return past.gripper == gripper && past.object == grasp->object;
          });
    }
    return again;
  }

  // The grasps are sorted by first tick.
  const std::vector<GraspInterval>& grasps() const { return grasps_; }

 private:
  size_t grippers_;
  double dt_;
  std::vector<GraspInterval> grasps_;
  // Index of the latest grasp of each pair of object and gripper; -1 if there is none.
  std::vector<int> current_;
};

}  // namespace evalbus::metrics
