// Metrics of the grippers' contacts with objects. Defined by evalbus (docs/metrics.md).
#pragma once

#include <algorithm>
#include <vector>

#include "lcmtypes/clock.h"
#include "metrics/extended/extended_metric.h"
#include "metrics/sample/grasps.h"

namespace evalbus::metrics {

// Simulated time (s) of the first sample in which a gripper's pad touches a manipulated object. There is no
// value if none does.
class FirstTouch : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"first_touch_s"};
  explicit FirstTouch(const MetricsConfig& /*config*/) {}

  void Start() override { time_ = kNone; }
  void Add(const DerivedSample& derived) override {
    const std::span<const uint8_t> holding = derived.sample.holding;
    const bool touches = std::any_of(holding.begin(), holding.end(), [](uint8_t held) { return held != 0; });
    if (touches && !(time_ >= 0)) time_ = derived.sample.time;
  }
  void Values(std::span<double> values) const override { values[0] = time_; }

 private:
  double time_ = kNone;
};

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

// Computes for each gripper the mean of the grip force over the time for which it is above 0, and its peak
// (N). state_t.gripper defines the grip force, which the sim computes at every physics step. There is no
// value for a gripper that gripped nothing, or if the source does not provide forces.
class GripForce : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"grip_force_mean_N", "grip_force_peak_N"};
  explicit GripForce(const MetricsConfig& config) : grips_(config.grippers.size()) {}

  void Start() override { std::fill(grips_.begin(), grips_.end(), GripSample{}); }
  void Add(const DerivedSample& derived) override {
    if (!derived.sample.forces) return;
    for (size_t k = 0; k < grips_.size(); ++k) {
      const GripSample& grip = derived.sample.forces->grip[k];
      grips_[k].peak = std::max(grips_[k].peak, grip.peak);
      grips_[k].impulse += grip.impulse;
      grips_[k].time += grip.time;
    }
  }
  void Values(std::span<double> values) const override {
    for (size_t k = 0; k < grips_.size(); ++k) {
      const GripSample& grip = grips_[k];
      values[k] = grip.time > 0 ? grip.impulse / grip.time : kNone;
      values[grips_.size() + k] = grip.time > 0 ? grip.peak : kNone;
    }
  }

 private:
  std::vector<GripSample> grips_;
};

}  // namespace evalbus::metrics
