#include "viz/report/metric_name.h"

#include <algorithm>
#include <utility>

namespace evalbus::viz {
namespace {

// RoboEval's names carry no unit; docs/metrics.md has it.
constexpr std::pair<const char*, const char*> kRoboEval[] = {
    {"completion_time", "s"},
    {"target_distance", "m"},
    {"object_pose_error", "rad"},
    {"bimanual_arm_velocity_difference", "rad/s"},
    {"bimanual_gripper_vertical_difference", "m"},
    {"cartesian_path_length", "m"},
    {"joint_path_length", "rad"},
    {"orientation_path_length", "rad"},
    {"cartesian_jerk", "m/s³"},
    {"joint_jerk", "rad/s³"},
};

constexpr std::pair<const char*, const char*> kSuffixes[] = {
    {"_m", "m"},           {"_s", "s"},           {"_rad", "rad"},   {"_deg", "°"},
    {"_mps", "m/s"},       {"_mps2", "m/s²"},     {"_mps3", "m/s³"}, {"_radps", "rad/s"},
    {"_radps2", "rad/s²"}, {"_radps3", "rad/s³"}, {"_J", "J"},       {"_W", "W"},
    {"_N", "N"},           {"_Nm", "N m"},        {"_Hz", "Hz"},     {"_mm", "mm"},
};

std::string Words(std::string text) {
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

}  // namespace

MetricName NameForPeople(const std::string& metric) {
  const std::string prefix = "extended.";
  const std::string name = metric.starts_with(prefix) ? metric.substr(prefix.size()) : metric;
  const size_t dot = name.find('.');
  std::string base = name.substr(0, dot);
  MetricName result;
  for (const auto& [ending, unit] : kRoboEval) {
    if (base.ends_with(ending)) result.unit = unit;
  }
  for (const auto& [suffix, unit] : kSuffixes) {
    if (!base.ends_with(suffix)) continue;
    result.unit = unit;
    base.resize(base.size() - std::string(suffix).size());
    break;
  }
  result.label = Words(base);
  if (dot != std::string::npos) result.label += ", " + Words(name.substr(dot + 1));
  return result;
}

}  // namespace evalbus::viz
