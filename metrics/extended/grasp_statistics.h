// Number and duration of each gripper's grasps. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>

#include "lcmtypes/clock.h"
#include "metrics/extended/extended_metric.h"
#include "metrics/sample/grasps.h"

namespace evalbus::metrics {

// Computes for each gripper the number of grasps (see grasps.h) of any object, their total duration (s), the
// longest duration (s), and the number of grasps of an object that the same gripper had grasped before.
class GraspStatistics : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"grasp_count", "grasp_time_s", "longest_grasp_s", "regrasp_count"};
  explicit GraspStatistics(const MetricsConfig& config)
      : grippers_(config.grippers.size()), dt_(config.control_dt), grasps_(config) {}

  void Start() override { grasps_.Start(); }
  void Add(const DerivedSample& derived) override {
    grasps_.Add(derived.sample.tick, derived.sample.pinched);
  }
  void Values(std::span<double> values) const override {
    std::fill(values.begin(), values.end(), 0);
    for (const GraspInterval& grasp : grasps_.grasps()) {
      const double ticks = static_cast<double>(grasp.ticks());
      double& longest = values[2 * grippers_ + grasp.gripper];
      values[grasp.gripper] += 1;
      values[grippers_ + grasp.gripper] += ticks;
      longest = std::max(longest, ticks);
    }
    for (double& time : values.subspan(grippers_, 2 * grippers_))
      time = TickTime(static_cast<int64_t>(time), dt_);
    for (size_t gripper = 0; gripper < grippers_; ++gripper) {
      values[3 * grippers_ + gripper] = static_cast<double>(grasps_.Regrasps(static_cast<int>(gripper)));
    }
  }

 private:
  size_t grippers_;
  double dt_;
  Grasps grasps_;
};

}  // namespace evalbus::metrics
