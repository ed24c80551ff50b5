#include "metrics/episode/rollout_metrics.h"

#include <cmath>
#include <stdexcept>

namespace evalbus::metrics {
namespace {

bool AllFinite(std::span<const double> x) {
  // 0 * x is 0 for finite x and NaN otherwise: one branch for the whole span.
  double sum = 0;
  for (double value : x) sum += 0 * value;
  return sum == 0;
}

double Norm(const std::array<double, 4>& q) {
  return std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
}

template <typename Accumulators>
void StartAll(Accumulators& accumulators) {
  for (auto& accumulator : accumulators) accumulator.Start();
}

}  // namespace

RolloutMetrics::RolloutMetrics(MetricsConfig config)
    : config_(std::move(config)),
      owners_(config_.geom_owner),
      target_distance_(config_.target_distances.size()),
      pose_error_(config_.pose_errors.size()),
      stages_(config_.stages),
      slips_(config_.objects.size(), config_.grippers.size(), config_.slip_sample_window),
      env_collisions_(config_.collision_sample_window),
      self_collisions_(config_.collision_sample_window),
      extended_(config_) {
  if (!(config_.control_dt > 0) || config_.slip_sample_window < 1 || config_.collision_sample_window < 1) {
    throw std::invalid_argument("RolloutMetrics: control_dt and the sample windows must be positive");
  }
  for (const ArmConfig& arm : config_.arms) {
    cartesian_path_.emplace_back(3);
    joint_path_.emplace_back(arm.num_joints);
    orientation_path_.emplace_back();
    cartesian_jerk_.emplace_back(3, config_.control_dt);
    joint_jerk_.emplace_back(arm.num_joints, config_.control_dt);
  }
}

void RolloutMetrics::Start(std::span<const double> gripper_opening, std::span<const uint8_t> holding) {
  num_samples_ = 0;
  refused_samples_ = AllFinite(gripper_opening) ? 0 : 1;
  last_tick_ = 0;
  time_ = 0;
  success_ = false;
  target_distance_.assign(target_distance_.size(), 0);
  pose_error_.assign(pose_error_.size(), 0);
  stages_.Start();
  slips_.Start(gripper_opening, holding);
  env_collisions_.Start();
  self_collisions_.Start();
  speed_difference_.Start();
  height_difference_.Start();
  StartAll(cartesian_path_);
  StartAll(joint_path_);
  StartAll(orientation_path_);
  StartAll(cartesian_jerk_);
  StartAll(joint_jerk_);
  extended_.Start();
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
    if (arm.joint_position.size() != joints || arm.joint_velocity.size() != joints ||
        (!arm.joint_torque.empty() && arm.joint_torque.size() != joints)) {
      return false;
    }
    const double norm = Norm(arm.wrist_quat);
    if (!AllFinite(arm.joint_position) || !AllFinite(arm.joint_velocity) || !AllFinite(arm.joint_torque) ||
        !AllFinite(arm.wrist_position) || !(norm > 0) || !std::isfinite(norm)) {
      return false;
    }
  }
  double sum = 0;
  for (const GeomContact& contact : sample.contacts) sum += 0 * contact.distance;
  return sum == 0 && AllFinite(sample.gripper_opening) && std::isfinite(sample.time) &&
         (!sample.clearance || std::isfinite(*sample.clearance));
}

bool RolloutMetrics::Step(const Sample& sample) {
  if (!Acceptable(sample)) {
    ++refused_samples_;
    return false;
  }
  const bool in_a_row = num_samples_ > 0 && sample.tick == last_tick_ + 1;
  last_tick_ = sample.tick;
  time_ = sample.time;
  ++num_samples_;

  for (size_t k = 0; k < sample.arm.size(); ++k) {
    const ArmSample& arm = sample.arm[k];
    if (!in_a_row) {
      cartesian_jerk_[k].RestartHistory();
      joint_jerk_[k].RestartHistory();
    }
    std::array<double, 4> quat = arm.wrist_quat;
    const double norm = Norm(quat);
    for (double& component : quat) component /= norm;

    if (config_.track_cartesian_path_length) cartesian_path_[k].Add(arm.wrist_position);
    if (config_.track_joint_path_length) joint_path_[k].Add(arm.joint_position);
    if (config_.track_orientation_path_length) orientation_path_[k].Add(quat);
    if (config_.track_cartesian_jerk) cartesian_jerk_[k].Add(arm.wrist_position);
    if (config_.track_joint_jerk) joint_jerk_[k].Add(arm.joint_position);
  }
  if (sample.arm.size() == 2) {
    const ArmSample &left = sample.arm[0], &right = sample.arm[1];
    if (config_.track_vel_sync) speed_difference_.Add(left.joint_velocity, right.joint_velocity);
    if (config_.track_vertical_sync) height_difference_.Add(left.wrist_position[2], right.wrist_position[2]);
  }
  if (config_.track_slippage) slips_.Add(sample.tick, sample.gripper_opening, sample.holding);
  contacts_.Sort(sample.contacts, owners_);
  if (config_.track_collisions) {
    env_collisions_.Add(contacts_.scene());
    self_collisions_.Add(contacts_.self());
  }
  extended_.Add(sample, contacts_, in_a_row);
  return true;
}

void RolloutMetrics::Values(metric_values_t* values) const {
  metric_values_t& v = *values;
  v.tracks_vel_sync = config_.track_vel_sync;
  v.tracks_vertical_sync = config_.track_vertical_sync;
  v.tracks_slippage = config_.track_slippage;
  v.tracks_collisions = config_.track_collisions;
  v.tracks_cartesian_jerk = config_.track_cartesian_jerk;
  v.tracks_joint_jerk = config_.track_joint_jerk;
  v.tracks_cartesian_path_length = config_.track_cartesian_path_length;
  v.tracks_joint_path_length = config_.track_joint_path_length;
  v.tracks_orientation_path_length = config_.track_orientation_path_length;
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

  v.slip_count = slips_.total();
  v.num_objects = config_.objects.size();
  v.object_name = config_.objects;
  v.slip_count_per_object = slips_.per_object();
  v.env_collision_count = env_collisions_.count();
  v.self_collision_count = self_collisions_.count();
  v.bimanual_arm_velocity_difference_radps = speed_difference_.mean();
  v.bimanual_gripper_vertical_difference_m = height_difference_.mean();

  const size_t arms = config_.arms.size();
  v.num_arms = arms;
  v.arm_name.resize(arms);
  for (auto* member : {&v.cartesian_path_length_m, &v.joint_path_length_rad, &v.orientation_path_length_rad,
                       &v.avg_cartesian_jerk_mps3, &v.rms_cartesian_jerk_mps3, &v.avg_joint_jerk_radps3,
                       &v.rms_joint_jerk_radps3}) {
    member->resize(arms);
  }
  v.num_jerk_samples = 0;
  for (size_t k = 0; k < arms; ++k) {
    v.arm_name[k] = config_.arms[k].name;
    v.cartesian_path_length_m[k] = cartesian_path_[k].length();
    v.joint_path_length_rad[k] = joint_path_[k].length();
    v.orientation_path_length_rad[k] = orientation_path_[k].length();
    v.num_jerk_samples = std::max(cartesian_jerk_[k].count(), joint_jerk_[k].count());
    v.avg_cartesian_jerk_mps3[k] = cartesian_jerk_[k].mean();
    v.rms_cartesian_jerk_mps3[k] = cartesian_jerk_[k].rms();
    v.avg_joint_jerk_radps3[k] = joint_jerk_[k].mean();
    v.rms_joint_jerk_radps3[k] = joint_jerk_[k].rms();
  }
  v.overall_avg_cartesian_jerk_mps3 = PooledMean(cartesian_jerk_);
  v.overall_rms_cartesian_jerk_mps3 = PooledRms(cartesian_jerk_);
  v.overall_avg_joint_jerk_radps3 = PooledMean(joint_jerk_);
  v.overall_rms_joint_jerk_radps3 = PooledRms(joint_jerk_);
}

void RolloutMetrics::FillBookkeeping(extended_metrics_t* extended) const {
  const std::vector<StageState>& stages = stages_.stages();
  extended->num_stages = stages.size();
  extended->stage_time_s.resize(stages.size());
  for (size_t k = 0; k < stages.size(); ++k) extended->stage_time_s[k] = stages[k].reached_time;
  extended->refused_samples = refused_samples_;
}

void RolloutMetrics::Extended(extended_metrics_t* extended) const {
  FillBookkeeping(extended);
  extended_.Values(extended);
}

void RolloutMetrics::FinalExtended(extended_metrics_t* extended) const {
  FillBookkeeping(extended);
  extended_.FinalValues(extended);
}

}  // namespace evalbus::metrics
