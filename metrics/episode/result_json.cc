#include "metrics/episode/result_json.h"

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

namespace evalbus::metrics {
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
  for (size_t k = 0; k < e.name.size(); ++k) {
    // "peak_wrist_speed_mps.left": a value by arm or gripper.
    const size_t dot = e.name[k].find('.');
    ordered_json& value = dot == std::string::npos
                              ? result[e.name[k]]
                              : result[e.name[k].substr(0, dot)][e.name[k].substr(dot + 1)];
    if (std::isnan(e.value_mixed[k])) continue;  // null
    if (e.unit[k] == "count") {
      value = static_cast<int64_t>(e.value_mixed[k]);
    } else {
      value = e.value_mixed[k];
    }
  }
  if (e.num_stages > 0) {
    ordered_json& times = result["stage_time_s"];
    for (int k = 0; k < e.num_stages; ++k) {
      // A stage that was never reached has no time.
      times[std::to_string(v.stage_index[k])] =
          e.stage_time_s[k] < 0 ? ordered_json() : ordered_json(e.stage_time_s[k]);
    }
  }
  result["missing_ticks"] = e.missing_ticks;
  result["refused_samples"] = e.refused_samples;
  result["action_clips"] = e.action_clips;
  result["deadline_misses"] = e.deadline_misses;
  return result;
}

namespace {

ordered_json ConditionJson(const condition_t& condition) {
  ordered_json result;
  result["text"] = condition.text;
  result["predicate"] = condition.predicate;
  result["subject"] = condition.subject;
  if (!condition.other.empty()) result["other"] = condition.other;
  result["holds"] = condition.holds != 0;
  if (condition.has_value) {
    result["value"] = condition.value_mixed;
    result["comparison"] = condition.comparison;
    result["threshold"] = condition.threshold_mixed;
    result["unit"] = condition.unit;
  }
  result["tick"] = condition.tick;
  result["time_s"] = condition.time_s;
  return result;
}

ordered_json EventJson(const object_event_t& event) {
  ordered_json result;
  result["object"] = event.object;
  result["gripper"] = event.gripper;
  result["tick"] = event.tick;
  result["time_s"] = event.time_s;
  return result;
}

}  // namespace

ordered_json ExplanationJson(const explanation_t& e) {
  ordered_json result;
  result["text"] = e.text;
  result["last_stage"] = nullptr;
  if (e.last_stage_index > 0) {
    ordered_json& stage = result["last_stage"];
    stage["index"] = e.last_stage_index;
    stage["name"] = e.last_stage_name;
    stage["time_s"] = e.last_stage_time_s;
  }
  result["conditions"] = ordered_json::array();
  for (const condition_t& condition : e.condition) result["conditions"].push_back(ConditionJson(condition));
  result["first_collision"] = nullptr;
  if (e.has_first_collision) {
    ordered_json& collision = result["first_collision"];
    collision["robot_geom"] = e.first_collision_robot_geom;
    collision["scene_geom"] = e.first_collision_scene_geom;
    collision["tick"] = e.first_collision_tick;
    collision["time_s"] = e.first_collision_time_s;
  }
  result["collisions_per_geom"] = ordered_json::object();
  for (size_t k = 0; k < e.collision_name.size(); ++k) {
    result["collisions_per_geom"][e.collision_name[k]] = e.collision_count[k];
  }
  result["slips"] = ordered_json::array();
  for (const object_event_t& slip : e.slip) result["slips"].push_back(EventJson(slip));
  result["grasps"] = ordered_json::array();
  for (const object_event_t& grasp : e.grasp) {
    result["grasps"].push_back(EventJson(grasp));
    result["grasps"].back()["duration_s"] = grasp.duration_s;
  }
  return result;
}

}  // namespace evalbus::metrics
