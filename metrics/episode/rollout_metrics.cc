#include "metrics/episode/rollout_metrics.h"

#include <cmath>
#include <stdexcept>

#include "lcmtypes/metric_catalog.h"

namespace evalbus::metrics {
namespace {

bool AllFinite(std::span<const double> x) {
  // 0 * x is 0 for finite x and NaN otherwise, so a single branch is enough for the whole span.
  double sum = 0;
  for (double value : x) sum += 0 * value;
  return sum == 0;
}

}  // namespace

RolloutMetrics::RolloutMetrics(MetricsConfig config)
    : config_(std::move(config)),
      deriver_(config_),
      target_distance_(config_.target_distances.size()),
      pose_error_(config_.pose_errors.size()),
      stages_(config_.stages),
      roboeval_(config_),
      extended_(config_) {
  if (!(config_.control_dt > 0) || config_.slip_sample_window < 1 || config_.collision_sample_window < 1) {
    throw std::invalid_argument("RolloutMetrics: control_dt and the sample windows must be positive");
  }
}

void RolloutMetrics::Start(std::span<const double> gripper_opening, std::span<const uint8_t> holding) {
  num_samples_ = 0;
  refused_samples_ = AllFinite(gripper_opening) ? 0 : 1;
  time_ = 0;
  success_ = false;
  target_distance_.assign(target_distance_.size(), 0);
  pose_error_.assign(pose_error_.size(), 0);
  stages_.Start();
  deriver_.Start();
  roboeval_.ForEach([&](auto& metric) { metric.Start({gripper_opening, holding}); });
  extended_.Start();
}

bool RolloutMetrics::Acceptable(const ForceSample& forces) const {
  double sum = forces.unwanted_impulse + forces.unwanted_touch_energy;
  for (const GripSample& grip : forces.grip) sum += grip.peak + grip.impulse + grip.time;
  return forces.grip.size() == config_.grippers.size() && std::isfinite(sum) && AllFinite(forces.scene) &&
         AllFinite(forces.object) && AllFinite(forces.self);
}

bool RolloutMetrics::Acceptable(const Sample& sample) const {
  if (sample.arm.size() != config_.arms.size() || sample.gripper_opening.size() != config_.grippers.size() ||
      sample.holding.size() != config_.objects.size() * config_.grippers.size() ||
      (!sample.pinched.empty() && sample.pinched.size() != sample.holding.size())) {
    return false;
  }
  for (size_t k = 0; k < sample.arm.size(); ++k) {
    const ArmSample& arm = sample.arm[k];
    const size_t joints = config_.arms[k].num_joints;
    if (arm.joint_position.size() != joints || arm.joint_velocity.size() != joints) return false;
    const double norm = SampleDeriver::Norm(arm.wrist_quat);
    if (!AllFinite(arm.joint_position) || !AllFinite(arm.joint_velocity) ||
        !std::isfinite(arm.mechanical_work.value_or(0)) || !AllFinite(arm.joint_torque_peak) ||
        !AllFinite(arm.joint_command) || !AllFinite(arm.wrist_position) || !(norm > 0) ||
        !std::isfinite(norm)) {
      return false;
    }
    const auto fits = [joints](size_t size) { return size == 0 || size == joints; };
    if (!fits(arm.joint_torque_peak.size()) || !fits(arm.joint_command.size())) return false;
  }
  double sum = 0;
  for (const GeomContact& contact : sample.contacts) sum += 0 * contact.distance;
  return sum == 0 && AllFinite(sample.gripper_opening) && std::isfinite(sample.time) &&
         (!sample.clearance || std::isfinite(*sample.clearance)) &&
         (!sample.forces || Acceptable(*sample.forces));
}

bool RolloutMetrics::Step(const Sample& sample) {
  if (!Acceptable(sample)) {
    ++refused_samples_;
    return false;
  }
  time_ = sample.time;
  ++num_samples_;
  const DerivedSample derived = deriver_.Derive(sample);
  roboeval_.ForEach([&](auto& metric) {
    if (config_.Tracks(metric.kTracked)) metric.Add(derived);
  });
  extended_.Add(derived);
  return true;
}

void RolloutMetrics::Values(metric_values_t* values) const {
  metric_values_t& v = *values;
  for (const TrackOption& option : TrackOptions()) v.*option.member = config_.Tracks(option.member);
  v.num_samples = num_samples_;
  v.success = success_;
  v.completion_time_s = time_;

  const std::vector<StageState>& stages = stages_.stages();
  v.num_stages = stages.size();
  v.stage_index.resize(stages.size());
  v.stage_name.resize(stages.size());
  v.stage_reached.resize(stages.size());
  for (size_t k = 0; k < stages.size(); ++k) {
    v.stage_index[k] = stages[k].index;
    v.stage_name[k] = stages[k].name;
    v.stage_reached[k] = stages[k].reached;
  }
  v.subtask_progress = stages_.progress();

  v.num_target_distances = target_distance_.size();
  v.target_distance_name = config_.target_distances;
  v.target_distance_m = target_distance_;
  v.num_pose_errors = pose_error_.size();
  v.pose_error_name = config_.pose_errors;
  v.object_pose_error_rad = pose_error_;

  v.num_objects = config_.objects.size();
  v.object_name = config_.objects;
  v.num_arms = config_.arms.size();
  v.arm_name.resize(config_.arms.size());
  for (size_t k = 0; k < config_.arms.size(); ++k) v.arm_name[k] = config_.arms[k].name;

  v.num_jerk_samples = 0;
  roboeval_.ForEach([&](const auto& metric) { metric.Values(&v); });
}

}  // namespace evalbus::metrics
