#include "metrics/result_json.h"

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

namespace evalbus {
namespace {

using nlohmann::ordered_json;

// One entry without a name is a plain number.
ordered_json Named(const std::vector<std::string>& names, const std::vector<double>& values) {
  if (names.size() == 1 && names[0].empty()) return values[0];
  ordered_json result = ordered_json::object();
  for (size_t k = 0; k < names.size(); ++k) result[names[k]] = values[k];
  return result;
}

ordered_json ByArm(const metric_values_t& v, const std::vector<double>& values) {
  if (values.size() == 1) return values[0];
  ordered_json result = ordered_json::object();
  for (size_t k = 0; k < values.size(); ++k) result[v.arm_name[k]] = values[k];
  return result;
}

void AddPath(const metric_values_t& v, const std::string& name, const std::vector<double>& lengths,
             ordered_json* result) {
  (*result)[name] = ByArm(v, lengths);
  if (lengths.size() < 2) return;
  const double total = std::accumulate(lengths.begin(), lengths.end(), 0.0);
  (*result)["total_" + name] = total;
  (*result)["avg_" + name] = total / lengths.size();
}

void AddJerk(const metric_values_t& v, const std::string& name, const std::vector<double>& mean,
             const std::vector<double>& rms, double overall_mean, double overall_rms, ordered_json* result) {
  (*result)["avg_" + name] = ByArm(v, mean);
  (*result)["rms_" + name] = ByArm(v, rms);
  if (mean.size() < 2 || v.num_jerk_samples == 0) return;
  (*result)["overall_avg_" + name] = overall_mean;
  (*result)["overall_rms_" + name] = overall_rms;
}

}  // namespace

ordered_json ResultJson(const metric_values_t& v) {
  ordered_json result;
  result["success"] = v.success ? 1.0 : 0.0;
  result["completion_time"] = v.completion_time_s;
  if (v.num_stages > 0) {
    ordered_json& reached = result["task_stage_reached"];
    for (int k = 0; k < v.num_stages; ++k)
      reached[std::to_string(v.stage_index[k])] = v.stage_reached[k] != 0;
    result["subtask_progress"] = v.subtask_progress;
  }
  if (v.num_target_distances > 0) {
    result["target_distance"] = Named(v.target_distance_name, v.target_distance_m);
  }
  if (v.num_pose_errors > 0) result["object_pose_error"] = Named(v.pose_error_name, v.object_pose_error_rad);

  result["slip_count"] = v.slip_count;
  ordered_json& slips = result["slip_count_per_object"] = ordered_json::object();
  for (int k = 0; k < v.num_objects; ++k)
    slips["object_" + std::to_string(k + 1)] = v.slip_count_per_object[k];
  if (v.tracks_collisions) {
    result["env_collision_count"] = v.env_collision_count;
    result["self_collision_count"] = v.self_collision_count;
  }
  if (v.num_arms == 2 && v.num_samples > 0) {
    if (v.tracks_vel_sync)
      result["bimanual_arm_velocity_difference"] = v.bimanual_arm_velocity_difference_radps;
    if (v.tracks_vertical_sync) {
      result["bimanual_gripper_vertical_difference"] = v.bimanual_gripper_vertical_difference_m;
    }
  }
  if (v.tracks_cartesian_path_length) AddPath(v, "cartesian_path_length", v.cartesian_path_length_m, &result);
  if (v.tracks_joint_path_length) AddPath(v, "joint_path_length", v.joint_path_length_rad, &result);
  if (v.tracks_orientation_path_length) {
    AddPath(v, "orientation_path_length", v.orientation_path_length_rad, &result);
  }
  if (v.tracks_cartesian_jerk) {
    AddJerk(v, "cartesian_jerk", v.avg_cartesian_jerk_mps3, v.rms_cartesian_jerk_mps3,
            v.overall_avg_cartesian_jerk_mps3, v.overall_rms_cartesian_jerk_mps3, &result);
  }
  if (v.tracks_joint_jerk) {
    AddJerk(v, "joint_jerk", v.avg_joint_jerk_radps3, v.rms_joint_jerk_radps3,
            v.overall_avg_joint_jerk_radps3, v.overall_rms_joint_jerk_radps3, &result);
  }
  return result;
}

ordered_json ExtendedJson(const extended_metrics_t& e, const metric_values_t& v) {
  ordered_json result;
  if (e.has_clearance) {
    result["min_clearance_m"] = e.min_clearance_m;
    result["min_clearance_time_s"] = e.min_clearance_time_s;
  }
  result["peak_penetration_m"] = e.peak_penetration_m;
  result["contact_time_s"] = e.contact_time_s;
  if (e.num_stages > 0) {
    ordered_json& times = result["stage_time_s"];
    for (int k = 0; k < e.num_stages; ++k) {
      // A stage that was never reached has no time.
      times[std::to_string(v.stage_index[k])] =
          e.stage_time_s[k] < 0 ? ordered_json() : ordered_json(e.stage_time_s[k]);
    }
  }
  result["mechanical_work_J"] = ByArm(v, e.mechanical_work_J);
  result["peak_wrist_speed_mps"] = ByArm(v, e.peak_wrist_speed_mps);
  if (std::isfinite(e.min_joint_limit_margin_rad)) {
    result["min_joint_limit_margin_rad"] = e.min_joint_limit_margin_rad;
  }
  result["missing_ticks"] = e.missing_ticks;
  result["refused_samples"] = e.refused_samples;
  result["action_clips"] = e.action_clips;
  result["deadline_misses"] = e.deadline_misses;
  return result;
}

}  // namespace evalbus
