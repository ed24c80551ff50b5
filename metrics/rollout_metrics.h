// All metrics of one episode, fed tick by tick and readable at any tick. Pure: no bus, no clock, no file.
// Definitions: docs/metrics.md. A new metric is one accumulator in a header of its own and its lines in
// rollout_metrics.cc.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "evalbus/extended_metrics_t.hpp"
#include "evalbus/metric_values_t.hpp"
#include "metrics/bimanual.h"
#include "metrics/collisions.h"
#include "metrics/effort.h"
#include "metrics/jerk.h"
#include "metrics/path_length.h"
#include "metrics/safety.h"
#include "metrics/sample.h"
#include "metrics/slips.h"
#include "metrics/stages.h"
#include "models/task_description.h"

namespace evalbus {

struct ArmConfig {
  std::string name;
  int num_joints = 0;
  // Joint limits (rad) by joint, both empty where not known.
  std::vector<double> joint_lower;
  std::vector<double> joint_upper;
};

// What is tracked, and the sample windows (>= 1), are a task's own options. A collision window of 20 gives
// the reference implementation's collision counts.
struct MetricsConfig : MetricsOptions {
  std::vector<ArmConfig> arms;
  int num_grippers = 0;
  // Manipulated objects in the task's order.
  std::vector<std::string> objects;
  std::vector<GeomOwner> geom_owner;
  // Simulated time between ticks (s): physics steps per tick x physics step.
  double control_dt = 0;

  std::vector<StageState> stages;
  // One entry with an empty name is a plain number in the result.
  std::vector<std::string> target_distances;
  std::vector<std::string> pose_errors;
};

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

  // Fill in every member; no allocation when *values was filled by the same object before.
  void Values(metric_values_t* values) const;
  // missing_ticks, action_clips and deadline_misses are left alone: they are not known here.
  void Extended(extended_metrics_t* extended) const;

 private:
  bool Acceptable(const Sample& sample) const;

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
  CollisionCounter collisions_;
  ArmSpeedDifference speed_difference_;
  GripperHeightDifference height_difference_;
  // By arm.
  std::vector<PathLength> cartesian_path_;
  std::vector<PathLength> joint_path_;
  std::vector<OrientationPathLength> orientation_path_;
  std::vector<Jerk> cartesian_jerk_;
  std::vector<Jerk> joint_jerk_;
  std::vector<MechanicalWork> work_;
  std::vector<PeakSpeed> wrist_speed_;

  MinClearance clearance_;
  PeakPenetration penetration_;
  ContactTime contact_time_;
  JointLimitMargin joint_margin_;
};

}  // namespace evalbus
