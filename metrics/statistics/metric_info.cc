#include "metrics/statistics/metric_info.h"

namespace evalbus::metrics {
namespace {

using enum Better;

constexpr bool kEffort = true, kAlways = false;

constexpr MetricInfo kMainMetrics[] = {
    {"completion_time", "completion time", "s", 1, kLower, kEffort},
    {"subtask_progress", "subtask progress", "%", 100, kHigher, kAlways},
    {"slip_count", "slips", "", 1, kLower, kAlways},
    {"env_collision_count", "collisions with the scene", "", 1, kLower, kAlways},
    {"self_collision_count", "self collisions", "", 1, kLower, kAlways},
    {"extended.contact_time_s", "time touching the scene", "s", 1, kLower, kAlways},
    {"extended.min_clearance_m", "smallest clearance", "mm", 1e3, kHigher, kAlways},
    {"extended.peak_penetration_m", "deepest penetration", "mm", 1e3, kLower, kAlways},
    {"cartesian_path_length", "wrist path", "m", 1, kLower, kEffort},
    {"total_cartesian_path_length", "wrist path, both arms", "m", 1, kLower, kEffort},
    {"joint_path_length", "joint path", "rad", 1, kLower, kEffort},
    {"total_joint_path_length", "joint path, both arms", "rad", 1, kLower, kEffort},
    {"orientation_path_length", "wrist rotation", "rad", 1, kLower, kEffort},
    {"total_orientation_path_length", "wrist rotation, both arms", "rad", 1, kLower, kEffort},
    {"extended.mechanical_work_J", "mechanical work", "J", 1, kLower, kEffort},
    {"extended.mechanical_work_J.left", "mechanical work, left", "J", 1, kLower, kEffort},
    {"extended.mechanical_work_J.right", "mechanical work, right", "J", 1, kLower, kEffort},
    {"bimanual_arm_velocity_difference", "arm speed difference", "rad/s", 1, kLower, kAlways},
    {"bimanual_gripper_vertical_difference", "gripper height difference", "mm", 1e3, kLower, kAlways},
    {"rms_cartesian_jerk", "wrist jerk, rms", "m/s³", 1, kLower, kEffort},
    {"overall_rms_cartesian_jerk", "wrist jerk, rms", "m/s³", 1, kLower, kEffort},
    {"rms_joint_jerk", "joint jerk, rms", "rad/s³", 1, kLower, kEffort},
    {"overall_rms_joint_jerk", "joint jerk, rms", "rad/s³", 1, kLower, kEffort},
};

}  // namespace

std::span<const MetricInfo> MainMetrics() { return kMainMetrics; }

}  // namespace evalbus::metrics
