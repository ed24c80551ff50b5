// Number and duration of each gripper's grasps. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>

#include "lcmtypes/clock.h"
#include "metrics/extended/extended_metric.h"
#include "metrics/sample/grasps.h"

namespace evalbus::metrics {

// By gripper: number of grasps (see grasps.h) of any object, their total duration (s) and the longest one
// (s).
class GraspStatistics : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"grasp_count", "grasp_time_s", "longest_grasp_s"};
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
    for (double& time : values.subspan(grippers_)) time = TickTime(static_cast<int64_t>(time), dt_);
  }

 private:
  size_t grippers_;
  double dt_;
  Grasps grasps_;
};

}  // namespace evalbus::metrics
