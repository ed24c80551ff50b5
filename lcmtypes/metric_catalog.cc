#include "lcmtypes/metric_catalog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"

namespace evalbus {
namespace {

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

constexpr MetricInfo kMetrics[] = {
    // Metrics defined by RoboEval.
    {.name = "success", .label = "success", .unit = "1", .kind = kSuccess, .better = kHigher},
    {.name = "completion_time",
     .label = "completion time",
     .unit = "s",
     .better = kLower,
     .effort = true,
     .main = 1,
     .number = &Values::completion_time_s},
    {.name = "task_stage_reached",
     .label = "stage reached",
     .unit = "1",
     .kind = kByStage,
     .better = kHigher},
    {.name = "subtask_progress",
     .label = "subtask progress",
     .unit = "1",
     .kind = kOfStages,
     .better = kHigher,
     .main = 2,
     .shown_unit = "%",
     .scale = 100,
     .most = 1,
     .number = &Values::subtask_progress},
    {.name = "target_distance",
     .label = "target distance",
     .unit = "m",
     .kind = kByName,
     .main = 3,
     .least = -kInfinity,
     .values = &Values::target_distance_m,
     .names = &Values::target_distance_name},
    {.name = "object_pose_error",
     .label = "pose error",
     .unit = "rad",
     .kind = kByName,
     .better = kLower,
     .risk = true,
     .main = 4,
     .values = &Values::object_pose_error_rad,
     .names = &Values::pose_error_name},
    {.name = "slip_count",
     .label = "slips",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .risk = true,
     .main = 5,
     .track = Track("track_slippage"),
     .count = &Values::slip_count},
    {.name = "slip_count_per_object",
     .label = "slips",
     .unit = "count",
     .kind = kByObject,
     .better = kLower,
     .risk = true,
     .track = Track("track_slippage")},
    {.name = "env_collision_count",
     .label = "collisions with the scene",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .risk = true,
     .main = 6,
     .track = Track("track_collisions"),
     .count = &Values::env_collision_count},
    {.name = "self_collision_count",
     .label = "self collisions",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .risk = true,
     .main = 7,
     .track = Track("track_collisions"),
     .count = &Values::self_collision_count},
    {.name = "bimanual_arm_velocity_difference",
     .label = "arm speed difference",
     .unit = "rad/s",
     .kind = kOfTwoArms,
     .main = 15,
     .track = Track("track_vel_sync"),
     .number = &Values::bimanual_arm_velocity_difference_radps},
    {.name = "bimanual_gripper_vertical_difference",
     .label = "gripper height difference",
     .unit = "m",
     .kind = kOfTwoArms,
     .main = 16,
     .shown_unit = "mm",
     .scale = 1e3,
     .track = Track("track_vertical_sync"),
     .number = &Values::bimanual_gripper_vertical_difference_m},
    {.name = "cartesian_path_length",
     .label = "wrist path",
     .unit = "m",
     .kind = kSumByArm,
     .better = kLower,
     .effort = true,
     .main = 11,
     .track = Track("track_cartesian_path_length"),
     .values = &Values::cartesian_path_length_m},
    {.name = "joint_path_length",
     .label = "joint path",
     .unit = "rad",
     .kind = kSumByArm,
     .better = kLower,
     .effort = true,
     .main = 12,
     .track = Track("track_joint_path_length"),
     .values = &Values::joint_path_length_rad},
    {.name = "orientation_path_length",
     .label = "wrist rotation",
     .unit = "rad",
     .kind = kSumByArm,
     .better = kLower,
     .effort = true,
     .main = 13,
     .track = Track("track_orientation_path_length"),
     .values = &Values::orientation_path_length_rad},
    {.name = "cartesian_jerk",
     .label = "wrist jerk",
     .unit = "m/s³",
     .kind = kJerk,
     .better = kLower,
     .effort = true,
     .amplifies_noise = true,
     .main = 17,
     .track = Track("track_cartesian_jerk"),
     .jerk = &kCartesianJerk},
    {.name = "joint_jerk",
     .label = "joint jerk",
     .unit = "rad/s³",
     .kind = kJerk,
     .better = kLower,
     .effort = true,
     .amplifies_noise = true,
     .main = 18,
     .track = Track("track_joint_jerk"),
     .jerk = &kJointJerk},

    // Metrics defined by evalbus.
    {.name = "extended.command_log_dimensionless_jerk",
     .label = "log dimensionless jerk of commands",
     .unit = "1",
     .kind = kByArm,
     .better = kHigher,
     .least = -kInfinity},
    {.name = "extended.contact_time_s",
     .label = "time touching the scene",
     .unit = "s",
     .better = kLower,
     .risk = true,
     .main = 8},
    {.name = "extended.env_collision_events",
     .label = "scene collision events",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .risk = true},
    {.name = "extended.self_collision_events",
     .label = "self collision events",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .risk = true},
    {.name = "extended.first_touch_s", .label = "time of first touch", .unit = "s", .better = kLower},
    {.name = "extended.grasp_count", .label = "grasps", .unit = "count", .kind = kByGripper},
    {.name = "extended.grasp_time_s", .label = "grasp time", .unit = "s", .kind = kByGripper},
    {.name = "extended.longest_grasp_s", .label = "longest grasp", .unit = "s", .kind = kByGripper},
    {.name = "extended.regrasp_count",
     .label = "regrasps",
     .unit = "count",
     .kind = kByGripper,
     .better = kLower,
     .risk = true},
    {.name = "extended.grip_force_mean_N", .label = "mean grip force", .unit = "N", .kind = kByGripper},
    {.name = "extended.grip_force_peak_N", .label = "peak grip force", .unit = "N", .kind = kByGripper},
    {.name = "extended.idle_time_s",
     .label = "idle time",
     .unit = "s",
     .kind = kByArm,
     .better = kLower,
     .effort = true},
    {.name = "extended.log_dimensionless_jerk",
     .label = "log dimensionless jerk",
     .unit = "1",
     .kind = kByArm,
     .better = kHigher,
     .amplifies_noise = true,
     .least = -kInfinity},
    {.name = "extended.mechanical_work_J",
     .label = "servo work",
     .unit = "J",
     .kind = kSumByArm,
     .better = kLower,
     .effort = true,
     .main = 14},
    {.name = "extended.min_clearance_m",
     .label = "smallest clearance",
     .unit = "m",
     .better = kHigher,
     .risk = true,
     .main = 9,
     .shown_unit = "mm",
     .scale = 1e3,
     .least = -kInfinity},
    {.name = "extended.min_clearance_time_s", .label = "time of smallest clearance", .unit = "s"},
    {.name = "extended.min_joint_limit_margin_rad",
     .label = "joint limit margin",
     .unit = "rad",
     .better = kHigher,
     .risk = true,
     .least = -kInfinity},
    {.name = "extended.min_joint_torque_margin",
     .label = "joint torque margin",
     .unit = "1",
     .better = kHigher,
     .risk = true,
     .shown_unit = "%",
     .scale = 100,
     .least = -kInfinity,
     .most = 1},
    {.name = "extended.p95_object_force_N",
     .label = "95th percentile of forces on objects",
     .unit = "N",
     .better = kLower,
     .risk = true},
    {.name = "extended.p95_scene_force_N",
     .label = "95th percentile of forces on the scene",
     .unit = "N",
     .better = kLower,
     .risk = true},
    {.name = "extended.p95_self_force_N",
     .label = "95th percentile of forces on itself",
     .unit = "N",
     .better = kLower,
     .risk = true},
    {.name = "extended.peak_object_force_N",
     .label = "peak force on objects",
     .unit = "N",
     .better = kLower,
     .risk = true,
     .main = 23},
    {.name = "extended.peak_scene_force_N",
     .label = "peak force on the scene",
     .unit = "N",
     .better = kLower,
     .risk = true,
     .main = 22},
    {.name = "extended.peak_self_force_N",
     .label = "peak force on itself",
     .unit = "N",
     .better = kLower,
     .risk = true},
    {.name = "extended.peak_penetration_m",
     .label = "deepest penetration",
     .unit = "m",
     .better = kLower,
     .risk = true,
     .main = 10,
     .shown_unit = "mm",
     .scale = 1e3},
    {.name = "extended.peak_touch_energy_J",
     .label = "peak energy of an unwanted touch",
     .unit = "J",
     .better = kLower,
     .risk = true},
    {.name = "extended.unwanted_impulse_Ns",
     .label = "impulse of unwanted contacts",
     .unit = "N s",
     .better = kLower,
     .risk = true},
    {.name = "extended.peak_wrist_acceleration_mps2",
     .label = "peak wrist acceleration",
     .unit = "m/s²",
     .kind = kByArm,
     .better = kLower,
     .amplifies_noise = true},
    {.name = "extended.peak_wrist_speed_mps", .label = "peak wrist speed", .unit = "m/s", .kind = kByArm},
    {.name = "extended.spectral_arc_length",
     .label = "spectral arc length",
     .unit = "1",
     .kind = kByArm,
     .better = kHigher,
     .least = -kInfinity},
    {.name = "extended.tracking_error_rad",
     .label = "tracking error",
     .unit = "rad",
     .kind = kByArm,
     .better = kLower},
    {.name = "extended.limit_violations",
     .label = "violations of force limits",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .risk = true,
     .main = 24},
    {.name = "extended.squeeze_excess_N",
     .label = "grip force above its limit",
     .unit = "N",
     .better = kLower,
     .risk = true,
     .main = 25},
    {.name = "extended.squeeze_time_s",
     .label = "time with a grip force above its limit",
     .unit = "s",
     .better = kLower,
     .risk = true},
    {.name = "extended.success_once",
     .label = "success at any time",
     .unit = "1",
     .better = kHigher,
     .main = 19,
     .shown_unit = "%",
     .scale = 100,
     .most = 1},
    {.name = "extended.success_end",
     .label = "success at the end",
     .unit = "1",
     .better = kHigher,
     .main = 20,
     .shown_unit = "%",
     .scale = 100,
     .most = 1},
    {.name = "extended.success_held_s",
     .label = "success held for",
     .unit = "s",
     .better = kHigher,
     .main = 21},
    {.name = "extended.stage_time_s", .label = "stage time", .unit = "s", .kind = kByStage, .better = kLower},
    {.name = "extended.stale_action_ratio",
     .label = "ticks without a new action",
     .unit = "1",
     .better = kLower,
     .shown_unit = "%",
     .scale = 100,
     .most = 1},
    {.name = "extended.effective_hz", .label = "new actions per second", .unit = "1/s", .better = kHigher},
    {.name = "extended.action_age_s",
     .label = "age of actions",
     .unit = "s",
     .better = kLower,
     .shown_unit = "ms",
     .scale = 1000},
    {.name = "extended.missing_ticks",
     .label = "missing ticks",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .counter = &extended_metrics_t::missing_ticks},
    {.name = "extended.refused_samples",
     .label = "refused samples",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .counter = &extended_metrics_t::refused_samples},
    {.name = "extended.action_clips",
     .label = "action clips",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .counter = &extended_metrics_t::action_clips},
    {.name = "extended.deadline_misses",
     .label = "late actions",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .counter = &extended_metrics_t::deadline_misses},
    {.name = "extended.unreachable_poses",
     .label = "unreachable poses",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .counter = &extended_metrics_t::unreachable_poses},
    {.name = "extended.singular_poses",
     .label = "singular poses",
     .unit = "count",
     .kind = kCount,
     .better = kLower,
     .counter = &extended_metrics_t::singular_poses},
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

}  // namespace evalbus
