// All metrics of one episode, updated tick by tick and readable at any tick. Pure: no bus, no clock, no file.
// Definitions: docs/metrics.md. Each formula is an accumulator: RoboEval's are in roboeval/, those defined by
// evalbus in extended/ (see extended_metric.h).
#pragma once

#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include "evalbus/metric_values_t.hpp"
#include "metrics/extended/extended_metrics.h"
#include "metrics/roboeval/arm_difference.h"
#include "metrics/roboeval/collisions.h"
#include "metrics/roboeval/jerk.h"
#include "metrics/roboeval/path_length.h"
#include "metrics/roboeval/slips.h"
#include "metrics/roboeval/stages.h"
#include "metrics/sample/derived_sample.h"
#include "metrics/sample/metrics_config.h"
#include "metrics/sample/sample.h"

namespace evalbus::metrics {

class RolloutMetrics {
 public:
  // Throws std::invalid_argument if dt or a window is not positive.
  explicit RolloutMetrics(MetricsConfig config);

  // Begins an episode from the reset state (tick 0) and discards the previous episode. If a gripper opening
  // is not finite, the reset state counts as a refused sample.
  void Start(std::span<const double> gripper_opening, std::span<const uint8_t> holding);

  // Adds one tick. If a number is not finite, a quaternion cannot be normalized or a size differs from the
  // config, returns false and changes nothing but refused_samples(). If ticks are missing, path lengths
  // continue from the last sample and the jerk resumes after four consecutive samples.
  bool Step(const Sample& sample);

  // These setters describe the state after the last Step() (or Start()).
  void SetStage(int index, bool reached) { stages_.Set(index, reached, time_); }
  void SetTargetDistance(size_t index, double value) { target_distance_[index] = value; }
  void SetPoseError(size_t index, double value) { pose_error_[index] = value; }
  void SetSuccess(bool success) { success_ = success; }

  int64_t refused_samples() const { return refused_samples_; }
  const MetricsConfig& config() const { return config_; }
  // Returns the simulated time of the last sample since the episode began, s.
  double time() const { return time_; }

  // Fills in every member. Does not allocate if this object has filled *values before.
  void Values(metric_values_t* values) const;
  const ExtendedMetrics& extended() const { return extended_; }

  const Stages& stages() const { return stages_; }
  const EnvCollisions& env_collisions() const { return std::get<EnvCollisions>(roboeval_); }
  const SelfCollisions& self_collisions() const { return std::get<SelfCollisions>(roboeval_); }
  const std::vector<Slip>& slips() const { return std::get<SlipCounter>(roboeval_).slips(); }
  // Contacts between robot and scene in the last sample; valid until the next Step() or Start().
  std::span<const SceneContact> scene_contacts() const { return deriver_.contacts().scene(); }

 private:
  // Holds one accumulator of each type.
  template <class... Metric>
  struct All : std::tuple<Metric...> {
    explicit All(const MetricsConfig& config) : std::tuple<Metric...>(Metric(config)...) {}
    void ForEach(auto f) { (f(std::get<Metric>(*this)), ...); }
    void ForEach(auto f) const { (f(std::get<Metric>(*this)), ...); }
  };

  bool Acceptable(const Sample& sample) const;
  bool Acceptable(const ForceSample& forces) const;

  MetricsConfig config_;
  SampleDeriver deriver_;

  int64_t num_samples_ = 0;
  int64_t refused_samples_ = 0;
  double time_ = 0;
  bool success_ = false;
  std::vector<double> target_distance_;
  std::vector<double> pose_error_;

  Stages stages_;
  // RoboEval's metrics. Each class has a constructor from MetricsConfig, kTracked (the flag that enables it),
  // Start, Add, and Values, which fills its members of the message. To add one, add it here and add a row to
  // lcmtypes/metric_catalog.cc.
  All<SlipCounter, EnvCollisions, SelfCollisions, ArmSpeedDifference, GripperHeightDifference, CartesianPath,
      JointPath, OrientationPath, CartesianJerk, JointJerk>
      roboeval_;
  ExtendedMetrics extended_;
};

}  // namespace evalbus::metrics
