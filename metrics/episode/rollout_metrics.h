// All metrics of one episode, fed tick by tick and readable at any tick. Pure: no bus, no clock, no file.
// Definitions: docs/metrics.md. Each formula is an accumulator in a header of its own; a new metric is one in
// extended/ (see extended_metric.h).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "evalbus/extended_metrics_t.hpp"
#include "evalbus/metric_values_t.hpp"
#include "metrics/extended/extended_metrics.h"
#include "metrics/metrics_config.h"
#include "metrics/roboeval/arm_speed_difference.h"
#include "metrics/roboeval/env_collisions.h"
#include "metrics/roboeval/gripper_height_difference.h"
#include "metrics/roboeval/jerk.h"
#include "metrics/roboeval/orientation_path_length.h"
#include "metrics/roboeval/path_length.h"
#include "metrics/roboeval/self_collisions.h"
#include "metrics/roboeval/slips.h"
#include "metrics/roboeval/stages.h"
#include "metrics/sample.h"

namespace evalbus::metrics {

class RolloutMetrics {
 public:
  // Throws std::invalid_argument for a config that makes no sense (dt or a window not positive).
  explicit RolloutMetrics(MetricsConfig config);

  // Begins an episode from the reset state (tick 0); nothing of the previous episode remains. An opening that
  // is not finite is a refused sample.
  void Start(std::span<const double> gripper_opening, std::span<const uint8_t> holding);

  // One tick. Returns false and changes nothing but refused_samples() where a number is not finite, a
  // quaternion cannot be normalised or a size differs from the config. Where ticks are missing the lengths go
  // on from the last sample and the jerk from the next four in a row.
  bool Step(const Sample& sample);

  // These describe the state after the last Step() (or Start()).
  void SetStage(int index, bool reached) { stages_.Set(index, reached, time_); }
  void SetTargetDistance(size_t index, double value) { target_distance_[index] = value; }
  void SetPoseError(size_t index, double value) { pose_error_[index] = value; }
  void SetSuccess(bool success) { success_ = success; }

  int64_t refused_samples() const { return refused_samples_; }
  const MetricsConfig& config() const { return config_; }
  // Simulated seconds of the last sample since the episode began.
  double time() const { return time_; }

  // Fill in every member; no allocation when *values was filled by the same object before.
  void Values(metric_values_t* values) const;
  // missing_ticks, action_clips and deadline_misses are left alone: they are not known here. The final values
  // are those at the end of the episode: they include what is too dear to be evaluated at every tick.
  void Extended(extended_metrics_t* extended) const;
  void FinalExtended(extended_metrics_t* extended) const;

  const Stages& stages() const { return stages_; }
  const EnvCollisions& env_collisions() const { return env_collisions_; }
  const SelfCollisions& self_collisions() const { return self_collisions_; }
  const std::vector<Slip>& slips() const { return slips_.slips(); }
  // Of the robot with the scene, at the last sample; valid until the next Step() or Start().
  std::span<const SceneContact> scene_contacts() const { return contacts_.scene(); }

 private:
  bool Acceptable(const Sample& sample) const;
  void FillBookkeeping(extended_metrics_t* extended) const;

  MetricsConfig config_;
  GeomOwners owners_;

  int64_t num_samples_ = 0;
  int64_t refused_samples_ = 0;
  int64_t last_tick_ = 0;
  double time_ = 0;
  bool success_ = false;
  std::vector<double> target_distance_;
  std::vector<double> pose_error_;

  Stages stages_;
  SlipCounter slips_;
  EnvCollisions env_collisions_;
  SelfCollisions self_collisions_;
  ArmSpeedDifference speed_difference_;
  GripperHeightDifference height_difference_;
  // By arm.
  std::vector<PathLength> cartesian_path_;
  std::vector<PathLength> joint_path_;
  std::vector<OrientationPathLength> orientation_path_;
  std::vector<Jerk> cartesian_jerk_;
  std::vector<Jerk> joint_jerk_;

  RobotContacts contacts_;
  ExtendedMetrics extended_;
};

}  // namespace evalbus::metrics
