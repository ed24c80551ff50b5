#include "metrics/episode/result_json.h"

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "base/interned.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/metric_catalog.h"
#include "lcmtypes/source.h"

namespace evalbus::metrics {
namespace {

using nlohmann::ordered_json;

ordered_json ByName(const std::vector<std::string>& names, const std::vector<double>& values) {
  ordered_json result = ordered_json::object();
  for (size_t k = 0; k < names.size(); ++k) result[names[k]] = values[k];
  return result;
}

ordered_json ByArm(const metric_values_t& v, const std::vector<double>& values) {
  return values.size() == 1 ? ordered_json(values[0]) : ByName(v.arm_name, values);
}

// Returns whether the dictionary contains the metric. The rule depends on the kind of the metric.
bool IsThere(const MetricInfo& metric, const metric_values_t& v) {
  switch (metric.kind) {
    case MetricKind::kByStage:
    case MetricKind::kOfStages:
      return v.num_stages > 0;
    case MetricKind::kOfTwoArms:
      return IsTracked(metric, v) && v.num_arms == 2 && v.num_samples > 0;
    case MetricKind::kByName:
      return !(v.*metric.names).empty();
    default:
      // RoboEval's two slip counts are always present.
      return IsTracked(metric, v) || metric.track->member == &metric_values_t::tracks_slippage;
  }
}

void AddSums(const std::string& name, const std::vector<double>& values, ordered_json* result) {
  if (values.size() < 2) return;
  const double total = std::accumulate(values.begin(), values.end(), 0.0);
  (*result)["total_" + name] = total;
  (*result)["avg_" + name] = total / values.size();
}

void AddJerk(const std::string& name, const JerkMembers& jerk, const metric_values_t& v,
             ordered_json* result) {
  (*result)["avg_" + name] = ByArm(v, v.*jerk.avg);
  (*result)["rms_" + name] = ByArm(v, v.*jerk.rms);
  if ((v.*jerk.avg).size() < 2 || v.num_jerk_samples == 0) return;
  (*result)["overall_avg_" + name] = v.*jerk.overall_avg;
  (*result)["overall_rms_" + name] = v.*jerk.overall_rms;
}

void Add(const MetricInfo& metric, const metric_values_t& v, ordered_json* result) {
  const std::string name(metric.name);
  switch (metric.kind) {
    case MetricKind::kSuccess:
      (*result)[name] = v.success ? 1.0 : 0.0;
      break;
    case MetricKind::kNumber:
    case MetricKind::kOfStages:
    case MetricKind::kOfTwoArms:
      if (!std::isnan(v.*metric.number)) (*result)[name] = v.*metric.number;
      break;
    case MetricKind::kCount:
      if (v.*metric.count != kUnavailableCount) (*result)[name] = v.*metric.count;
      break;
    case MetricKind::kByStage:
      for (int k = 0; k < v.num_stages; ++k) {
        (*result)[name][std::to_string(v.stage_index[k])] = v.stage_reached[k] != 0;
      }
      break;
    case MetricKind::kByObject:
      for (int k = 0; k < v.num_objects; ++k) {
        if (v.slip_count_per_object[k] == kUnavailableCount) continue;
        (*result)[name]["object_" + std::to_string(k + 1)] = v.slip_count_per_object[k];
      }
      if (v.num_objects == 0) (*result)[name] = ordered_json::object();
      break;
    case MetricKind::kByName: {
      const std::vector<std::string>& names = v.*metric.names;
      const bool is_plain = names.size() == 1 && names[0].empty();
      (*result)[name] = is_plain ? ordered_json((v.*metric.values)[0]) : ByName(names, v.*metric.values);
      break;
    }
    case MetricKind::kByArm:
    case MetricKind::kSumByArm:
    case MetricKind::kByGripper:
      (*result)[name] = ByArm(v, v.*metric.values);
      if (metric.kind == MetricKind::kSumByArm) AddSums(name, v.*metric.values, result);
      break;
    case MetricKind::kJerk:
      AddJerk(name, *metric.jerk, v, result);
      break;
  }
}

}  // namespace

ordered_json ResultJson(const metric_values_t& v) {
  ordered_json result;
  for (const MetricInfo& metric : Metrics()) {
    if (!metric.is_extended() && IsThere(metric, v)) Add(metric, v, &result);
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
    if (std::isnan(e.value_mixed[k])) continue;  // the value remains null
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
  for (const MetricInfo& metric : Metrics()) {
    if (metric.counter && e.*metric.counter != kUnavailableCount) {
      result[std::string(metric.wire_name())] = e.*metric.counter;
    }
  }
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
  for (const limit_violation_t& violation : e.violation) {
    result["limit_violations"].push_back({{"region", violation.region},
                                          {"body", violation.body},
                                          {"robot_body", violation.robot_body},
                                          {"limit", violation.limit},
                                          {"limit_N", violation.limit_N},
                                          {"force_N", violation.force_N},
                                          {"tick", violation.tick},
                                          {"time_s", violation.time_s}});
  }
  return result;
}

ordered_json CauseJson(const cause_t& cause) {
  return {{"kind", cause.kind}, {"time_s", cause.time_s}, {"text", cause.text}};
}

ordered_json ParametersJson(const episode_begin_t& begin) {
  ordered_json result = ordered_json::object();
  for (size_t k = 0; k < begin.parameter_name.size(); ++k) {
    result[begin.parameter_name[k]] = begin.parameter_value_mixed[k];
  }
  return result;
}

NamedPoses PosesOf(const episode_summary_t& summary) {
  NamedPoses poses;
  for (size_t k = 0; k < summary.final_pose_name.size(); ++k) {
    const double *p = summary.final_pose[k].position_m, *q = summary.final_pose[k].quat_wxyz;
    poses.emplace_back(Interned(summary.final_pose_name[k]),
                       Pose{.position = {p[0], p[1], p[2]}, .quaternion = {q[0], q[1], q[2], q[3]}});
  }
  return poses;
}

EpisodeResult ResultOf(const episode_begin_t& begin, const episode_summary_t& summary) {
  EpisodeResult result{
      .complete = summary.complete != 0,
      .invalid = summary.end_reason == end_reason::kServerError,
      .success = summary.metrics.success != 0,
      .failure_reason = summary.failure_reason,
      .values = NumbersOf(ResultJson(summary.metrics), ExtendedJson(summary.extended, summary.metrics)),
      .slips = summary.metrics.slip_count_per_object,
      .parameters = FlattenedValues(ParametersJson(begin)),
      .is_start_known = true,
      .final_poses = PosesOf(summary)};
  const explanation_t& e = summary.explanation;
  const bool is_decided = result.success || summary.end_reason == end_reason::kFailure;
  result.decided_at_start = is_decided && !e.condition.empty() && e.condition[0].tick <= 1;
  const metric_values_t& v = summary.metrics;
  for (int k = 0; k < v.num_stages; ++k)
    result.stages.emplace_back(v.stage_index[k], v.stage_reached[k] != 0);
  for (size_t k = 0; k < e.collision_name.size(); ++k) {
    result.collisions[e.collision_name[k]] = e.collision_count[k];
  }
  return result;
}

}  // namespace evalbus::metrics
