#include "lcmtypes/metric_catalog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"

namespace evalbus {
namespace {

using enum MetricInput;
using enum MetricKind;
using Values = metric_values_t;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Better kLower = Better::kLower, kHigher = Better::kHigher;

// Groups of metrics that a task can switch off.
constexpr TrackOption kTrackOptions[] = {
    {"track_vel_sync", &Values::tracks_vel_sync},
    {"track_vertical_sync", &Values::tracks_vertical_sync},
    {"track_slippage", &Values::tracks_slippage},
    {"track_collisions", &Values::tracks_collisions},
    {"track_cartesian_jerk", &Values::tracks_cartesian_jerk},
    {"track_joint_jerk", &Values::tracks_joint_jerk},
    {"track_cartesian_path_length", &Values::tracks_cartesian_path_length},
    {"track_joint_path_length", &Values::tracks_joint_path_length},
    {"track_orientation_path_length", &Values::tracks_orientation_path_length},
};

constexpr const TrackOption* Track(std::string_view key) {
  for (const TrackOption& option : kTrackOptions) {
    if (option.key == key) return &option;
  }
  throw "no such key";
}

constexpr JerkMembers kCartesianJerk = {&Values::avg_cartesian_jerk_mps3, &Values::rms_cartesian_jerk_mps3,
                                        &Values::overall_avg_cartesian_jerk_mps3,
                                        &Values::overall_rms_cartesian_jerk_mps3};
constexpr JerkMembers kJointJerk = {&Values::avg_joint_jerk_radps3, &Values::rms_joint_jerk_radps3,
                                    &Values::overall_avg_joint_jerk_radps3,
                                    &Values::overall_rms_joint_jerk_radps3};

// Attributes of a metric besides its name, label, unit, kind, input and better direction.
struct Main {
  int position;
};
struct Shown {
  std::string_view unit;
  double scale, most;
};
struct Signed {};
constexpr auto kEffort = &MetricInfo::effort;
constexpr auto kRisk = &MetricInfo::risk;
constexpr auto kAmplifiesNoise = &MetricInfo::amplifies_noise;
constexpr Shown kPercent = {"%", 100, 1}, kMillimeters = {"mm", 1e3, kInfinity},
                kMilliseconds = {"ms", 1e3, kInfinity};
constexpr Signed kSigned{};

constexpr void Set(MetricInfo* metric, MetricKind kind) { metric->kind = kind; }
constexpr void Set(MetricInfo* metric, Better better) { metric->better = better; }
constexpr void Set(MetricInfo* metric, bool MetricInfo::*flag) { metric->*flag = true; }
constexpr void Set(MetricInfo* metric, MetricInput input) { metric->input = input; }
constexpr void Set(MetricInfo* metric, Main main) { metric->main = main.position; }
constexpr void Set(MetricInfo* metric, Signed) { metric->least = -kInfinity; }
constexpr void Set(MetricInfo* metric, const TrackOption* track) { metric->track = track; }
constexpr void Set(MetricInfo* metric, double Values::*number) { metric->number = number; }
constexpr void Set(MetricInfo* metric, int64_t Values::*count) { metric->count = count; }
constexpr void Set(MetricInfo* metric, std::vector<double> Values::*values) { metric->values = values; }
constexpr void Set(MetricInfo* metric, std::vector<std::string> Values::*names) { metric->names = names; }
constexpr void Set(MetricInfo* metric, const JerkMembers* jerk) { metric->jerk = jerk; }
constexpr void Set(MetricInfo* metric, int64_t extended_metrics_t::*counter) { metric->counter = counter; }
constexpr void Set(MetricInfo* metric, Shown shown) {
  metric->shown_unit = shown.unit;
  metric->scale = shown.scale;
  metric->most = shown.most;
}

// Returns a row of the table; its attributes may be in any order.
template <class... Attributes>
constexpr MetricInfo Row(std::string_view name, std::string_view label, std::string_view unit,
                         Attributes... attributes) {
  MetricInfo metric{.name = name, .label = label, .unit = unit};
  (Set(&metric, attributes), ...);
  return metric;
}

constexpr MetricInfo kMetrics[] = {
    // Metrics defined by RoboEval.
    Row("success", "success", "1", kSuccess, kHigher),
    Row("completion_time", "completion time", "s", kLower, kEffort, Main{1}, &Values::completion_time_s),
    Row("task_stage_reached", "stage reached", "1", kByStage, kHigher),
    Row("subtask_progress", "subtask progress", "1", kOfStages, kHigher, kStages, Main{2}, kPercent,
        &Values::subtask_progress),
    Row("target_distance", "target distance", "m", kByName, Main{3}, kSigned, &Values::target_distance_m,
        &Values::target_distance_name),
    Row("object_pose_error", "pose error", "rad", kByName, kLower, kRisk, Main{4},
        &Values::object_pose_error_rad, &Values::pose_error_name),
    Row("slip_count", "slips", "count", kCount, kLower, kRisk, kObjects, Main{5}, Track("track_slippage"),
        &Values::slip_count),
    Row("slip_count_per_object", "slips", "count", kByObject, kLower, kRisk, Track("track_slippage")),
    Row("env_collision_count", "collisions with the scene", "count", kCount, kLower, kRisk,
        kForbiddenContactGeoms, Main{6}, Track("track_collisions"), &Values::env_collision_count),
    Row("self_collision_count", "self collisions", "count", kCount, kLower, kRisk, Main{7},
        Track("track_collisions"), &Values::self_collision_count),
    Row("bimanual_arm_velocity_difference", "arm speed difference", "rad/s", kOfTwoArms, Main{15},
        Track("track_vel_sync"), &Values::bimanual_arm_velocity_difference_radps),
    Row("bimanual_gripper_vertical_difference", "gripper height difference", "m", kOfTwoArms, Main{16},
        kMillimeters, Track("track_vertical_sync"), &Values::bimanual_gripper_vertical_difference_m),
    Row("cartesian_path_length", "wrist path", "m", kSumByArm, kLower, kEffort, Main{11},
        Track("track_cartesian_path_length"), &Values::cartesian_path_length_m),
    Row("joint_path_length", "joint path", "rad", kSumByArm, kLower, kEffort, Main{12},
        Track("track_joint_path_length"), &Values::joint_path_length_rad),
    Row("orientation_path_length", "wrist rotation", "rad", kSumByArm, kLower, kEffort, Main{13},
        Track("track_orientation_path_length"), &Values::orientation_path_length_rad),
    Row("cartesian_jerk", "wrist jerk", "m/s³", kJerk, kLower, kEffort, kAmplifiesNoise, Main{17},
        Track("track_cartesian_jerk"), &kCartesianJerk),
    Row("joint_jerk", "joint jerk", "rad/s³", kJerk, kLower, kEffort, kAmplifiesNoise, Main{18},
        Track("track_joint_jerk"), &kJointJerk),

    // Metrics defined by evalbus.
    Row("extended.command_log_dimensionless_jerk", "log dimensionless jerk of commands", "1", kByArm, kHigher,
        kRisk, kPhysics, kSigned),
    Row("extended.contact_time_s", "time touching the scene", "s", kLower, kRisk, kForbiddenContactGeoms,
        Main{8}),
    Row("extended.env_collision_events", "scene collision events", "count", kCount, kLower, kRisk,
        kForbiddenContactGeoms),
    Row("extended.self_collision_events", "self collision events", "count", kCount, kLower, kRisk),
    Row("extended.first_touch_s", "time of first touch", "s", kLower, kObjects),
    Row("extended.grasp_count", "grasps", "count", kByGripper, kObjects),
    Row("extended.grasp_time_s", "grasp time", "s", kByGripper, kObjects),
    Row("extended.longest_grasp_s", "longest grasp", "s", kByGripper, kObjects),
    Row("extended.regrasp_count", "regrasps", "count", kByGripper, kLower, kRisk, kObjects),
    Row("extended.grip_force_mean_N", "mean grip force", "N", kByGripper, kPhysics),
    Row("extended.grip_force_peak_N", "peak grip force", "N", kByGripper, kPhysics),
    Row("extended.idle_time_s", "idle time", "s", kByArm, kLower, kEffort),
    Row("extended.log_dimensionless_jerk", "log dimensionless jerk", "1", kByArm, kHigher, kRisk,
        kAmplifiesNoise, kSigned),
    Row("extended.mechanical_work_J", "servo work", "J", kSumByArm, kLower, kEffort, kPhysics, Main{14}),
    Row("extended.min_clearance_m", "smallest clearance", "m", kHigher, kRisk, kForbiddenContactGeoms,
        Main{9}, kMillimeters, kSigned),
    Row("extended.min_clearance_time_s", "time of smallest clearance", "s", kForbiddenContactGeoms),
    Row("extended.min_joint_limit_margin_rad", "joint limit margin", "rad", kHigher, kRisk, kSigned),
    Row("extended.min_joint_torque_margin", "joint torque margin", "1", kHigher, kRisk, kPhysics, kPercent,
        kSigned),
    Row("extended.p95_object_force_N", "95th percentile of forces on objects", "N", kLower, kRisk, kPhysics),
    Row("extended.p95_scene_force_N", "95th percentile of forces on the scene", "N", kLower, kRisk, kPhysics),
    Row("extended.p95_self_force_N", "95th percentile of forces on itself", "N", kLower, kRisk, kPhysics),
    Row("extended.peak_object_force_N", "peak force on objects", "N", kLower, kRisk, kPhysics, Main{23}),
    Row("extended.peak_scene_force_N", "peak force on the scene", "N", kLower, kRisk, kPhysics, Main{22}),
    Row("extended.peak_self_force_N", "peak force on itself", "N", kLower, kRisk, kPhysics),
    Row("extended.peak_penetration_m", "deepest penetration", "m", kLower, kRisk, kObjects, Main{10},
        kMillimeters),
    Row("extended.peak_touch_energy_J", "peak energy of an unwanted touch", "J", kLower, kRisk, kPhysics),
    Row("extended.unwanted_impulse_Ns", "impulse of unwanted contacts", "N s", kLower, kRisk, kPhysics),
    Row("extended.peak_wrist_acceleration_mps2", "peak wrist acceleration", "m/s²", kByArm, kLower, kRisk,
        kAmplifiesNoise),
    Row("extended.peak_wrist_speed_mps", "peak wrist speed", "m/s", kByArm),
    Row("extended.spectral_arc_length", "spectral arc length", "1", kByArm, kHigher, kRisk, kSigned),
    Row("extended.tracking_error_rad", "tracking error", "rad", kByArm, kLower, kRisk, kPhysics),
    Row("extended.limit_violations", "violations of force limits", "count", kCount, kLower, kRisk, kPhysics,
        Main{24}),
    Row("extended.squeeze_excess_N", "grip force above its limit", "N", kLower, kRisk, kPhysics, Main{25}),
    Row("extended.squeeze_time_s", "time with a grip force above its limit", "s", kLower, kRisk, kPhysics),
    Row("extended.success_once", "success at any time", "1", kHigher, kVerdict, Main{19}, kPercent),
    Row("extended.success_end", "success at the end", "1", kHigher, kVerdict, Main{20}, kPercent),
    Row("extended.success_held_s", "success held for", "s", kHigher, kVerdict, Main{21}),
    Row("extended.stage_time_s", "stage time", "s", kByStage, kLower),
    Row("extended.stale_action_ratio", "ticks without a new action", "1", kLower, kPercent),
    Row("extended.effective_hz", "new actions per second", "1/s", kHigher),
    Row("extended.action_age_s", "age of actions", "s", kLower, kMilliseconds),
    Row("extended.missing_ticks", "missing ticks", "count", kCount, kLower,
        &extended_metrics_t::missing_ticks),
    Row("extended.refused_samples", "refused samples", "count", kCount, kLower,
        &extended_metrics_t::refused_samples),
    Row("extended.action_clips", "action clips", "count", kCount, kLower, kRisk, kPhysics,
        &extended_metrics_t::action_clips),
    Row("extended.deadline_misses", "late actions", "count", kCount, kLower, kRisk, kPhysics,
        &extended_metrics_t::deadline_misses),
    Row("extended.unreachable_poses", "unreachable poses", "count", kCount, kLower, kRisk, kPhysics,
        &extended_metrics_t::unreachable_poses),
    Row("extended.singular_poses", "singular poses", "count", kCount, kLower, kRisk, kPhysics,
        &extended_metrics_t::singular_poses),
};

struct Form {
  MetricPart part;
  std::string_view prefix, words;
};
constexpr Form kItself[] = {{MetricPart::kItself, "", ""}};
constexpr Form kSums[] = {{MetricPart::kItself, "", ""},
                          {MetricPart::kTotal, "total_", ", both arms"},
                          {MetricPart::kAverage, "avg_", ", average of the arms"}};
constexpr Form kJerks[] = {{MetricPart::kMean, "avg_", ", mean"},
                           {MetricPart::kRms, "rms_", ", rms"},
                           {MetricPart::kOverallMean, "overall_avg_", ", mean"},
                           {MetricPart::kOverallRms, "overall_rms_", ", rms"}};

std::span<const Form> FormsOf(const MetricInfo& metric) {
  if (metric.kind == kJerk) return kJerks;
  if (metric.kind == kSumByArm && !metric.is_extended()) return kSums;
  return kItself;
}

bool IsMain(const MetricNumber& number) {
  if (!number.metric || number.metric->main == 0) return false;
  const bool is_whole = number.of.empty() || number.metric->is_extended() || number.metric->kind == kByName;
  return number.part == MetricPart::kTotal || number.part == MetricPart::kOverallRms ||
         ((number.part == MetricPart::kItself || number.part == MetricPart::kRms) && is_whole);
}

}  // namespace

std::span<const MetricInfo> Metrics() { return kMetrics; }
std::span<const TrackOption> TrackOptions() { return kTrackOptions; }

MetricNumber FindMetric(const std::string& name) {
  const size_t begin = name.starts_with(kExtended) ? kExtended.size() : 0;
  const size_t dot = std::min(name.find('.', begin), name.size());
  const std::string_view whole = std::string_view(name).substr(0, dot);
  MetricNumber number;
  number.name = name;
  if (dot < name.size()) number.of = name.substr(dot + 1);
  for (const MetricInfo& metric : kMetrics) {
    for (const Form& form : FormsOf(metric)) {
      if (whole.starts_with(form.prefix) && whole.substr(form.prefix.size()) == metric.name) {
        number.metric = &metric;
        number.part = form.part;
      }
    }
  }
  return number;
}

std::vector<std::string> NamesOf(const MetricInfo& metric) {
  std::vector<std::string> names;
  for (const Form& form : FormsOf(metric)) {
    names.push_back(std::string(form.prefix) + std::string(metric.name));
  }
  return names;
}

std::string MetricNumber::label() const {
  if (!metric) return Words(name.starts_with(kExtended) ? name.substr(kExtended.size()) : name);
  // A task's own metric is shown under its name in the task.
  if (metric->kind == kByName && !of.empty()) return Words(of);
  std::string text(metric->label);
  for (const Form& form : FormsOf(*metric)) {
    if (form.part == part) text += form.words;
  }
  return of.empty() ? text : text + ", " + Words(of);
}

std::vector<MetricNumber> MainMetrics(const std::vector<std::string>& names) {
  std::vector<MetricNumber> numbers;
  for (const std::string& name : names) {
    MetricNumber number = FindMetric(name);
    if (IsMain(number)) numbers.push_back(std::move(number));
  }
  std::stable_sort(numbers.begin(), numbers.end(), [](const MetricNumber& a, const MetricNumber& b) {
    return a.metric->main < b.metric->main;
  });
  return numbers;
}

std::string ShownValue(const MetricInfo& metric, double value, double error) {
  const double shown = value * metric.scale;
  const bool is_whole = metric.unit == "count" || metric.shown_unit == "%";
  return is_whole && shown == std::floor(shown) ? fmt::format("{:.0f}", shown)
                                                : Number(shown, error * metric.scale);
}

std::string ShownWithUnit(const MetricInfo& metric, double value) {
  return WithUnit(ShownValue(metric, value), std::string(metric.shown_unit));
}

}  // namespace evalbus
