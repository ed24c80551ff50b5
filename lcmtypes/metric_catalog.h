// One table of all metrics. It has each metric's name in files and messages, its label for users, its unit,
// whether higher or lower values are better, and its members in messages. docs/metrics.md defines the
// metrics; a test compares it with this table.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "evalbus/extended_metrics_t.hpp"
#include "evalbus/metric_values_t.hpp"

namespace evalbus {

// Prefix of the names of metrics defined by evalbus.
inline constexpr std::string_view kExtended = "extended.";

enum class Better { kNeither, kLower, kHigher };

// The kind determines the number of values of a metric, and their names in episodes.jsonl (keys joined by
// dots).
enum class MetricKind {
  kNumber,     // NAME
  kCount,      // NAME, a whole number
  kSuccess,    // NAME, 1.0 or 0.0
  kOfStages,   // NAME; absent without stages
  kOfTwoArms,  // NAME; absent for one arm, and before the first sample
  kByStage,    // NAME.<index>
  kByObject,   // NAME.object_1 and so on, whole numbers
  kByName,     // NAME.<name in the task>; NAME for a single value without a name
  kByGripper,  // NAME.<gripper>; NAME for a single gripper
  kByArm,      // NAME.<arm>; NAME for a single arm
  kSumByArm,   // like kByArm; for two arms, RoboEval's metrics also have total_NAME and avg_NAME
  kJerk,       // avg_NAME, rms_NAME like kByArm; for two arms also overall_avg_NAME, overall_rms_NAME
};

// What a source must provide for a metric besides joint positions (docs/metrics.md, "What a source must
// know"). Velocities computed as differences of positions are sufficient.
enum class MetricInput {
  kNone,
  kPhysics,                // quantities that only a physics engine provides (model_info_t.has_physics)
  kObjects,                // the poses of all manipulated objects
  kForbiddenContactGeoms,  // poses of objects with parts that must not be touched, which count as scene
  kStages,                 // every stage of the task can be judged
  kVerdict,                // success and failure can be judged
};

// A group of metrics that a task can disable. `key` is its key in the task's `metrics` section; `member` is
// the member of metric_values_t that shows whether it is tracked.
struct TrackOption {
  std::string_view key;
  int8_t metric_values_t::*member;
};

struct JerkMembers {
  std::vector<double> metric_values_t::*avg;
  std::vector<double> metric_values_t::*rms;
  double metric_values_t::*overall_avg;
  double metric_values_t::*overall_rms;
};

struct MetricInfo {
  // Name in summary.json.
  std::string_view name;
  std::string_view label;
  // SI unit; "count" for whole numbers, "1" for values without unit.
  std::string_view unit;
  MetricKind kind = MetricKind::kNumber;
  Better better = Better::kNeither;
  // True if the metric measures effort. Effort is meaningful only for successful episodes, because a policy
  // that gives up immediately has the shortest path.
  bool effort = false;
  // True if the metric measures undesired events or motion. A policy that makes less progress, or whose
  // episodes end earlier, has fewer occasions for them, so a better value alone does not make it better.
  bool risk = false;
  // True for a second or third difference of positions, which amplifies the noise and jitter of a recording.
  // Such a metric cannot be compared between a recording and a simulation.
  bool amplifies_noise = false;
  MetricInput input = MetricInput::kNone;
  // Position, from 1, among the main metrics, which tables show and comparisons test. 0: not a main metric.
  int main = 0;
  // Unit of the shown value, which is value * scale. If it is empty, no unit is shown.
  std::string_view shown_unit = unit == "count" || unit == "1" ? std::string_view() : unit;
  double scale = 1;
  // Range of possible values, in SI units.
  double least = 0, most = std::numeric_limits<double>::infinity();
  // Group that the metric belongs to; null if it cannot be disabled.
  const TrackOption* track = nullptr;

  // Members of messages for RoboEval's metrics; the kind determines which are set. Success, stages and
  // objects have their own members.
  double metric_values_t::*number = nullptr;
  int64_t metric_values_t::*count = nullptr;
  std::vector<double> metric_values_t::*values = nullptr;
  std::vector<std::string> metric_values_t::*names = nullptr;
  const JerkMembers* jerk = nullptr;
  // Member for the counters that evalbus defines. Its other metrics are in extended_metrics_t by name.
  int64_t extended_metrics_t::*counter = nullptr;

  bool is_extended() const { return name.starts_with(kExtended); }
  // Returns the name without the prefix "extended.".
  std::string_view wire_name() const { return is_extended() ? name.substr(kExtended.size()) : name; }
};

// Returns true for a metric whose statistics across episodes use only successful episodes. This is the
// completion time, which only shows after a failure when the episode was stopped.
inline bool IsOfSuccessesOnly(std::string_view name) { return name == "completion_time"; }

// Returns RoboEval's metrics in the order of its dictionary, then the metrics defined by evalbus.
std::span<const MetricInfo> Metrics();
std::span<const TrackOption> TrackOptions();

// Returns true unless the task disables the metric.
inline bool IsTracked(const MetricInfo& metric, const metric_values_t& values) {
  return !metric.track || values.*metric.track->member;
}

// Selects which value of a metric a MetricNumber contains. Metrics without sums or means have only kItself.
enum class MetricPart { kItself, kTotal, kAverage, kMean, kRms, kOverallMean, kOverallRms };

// A value in the results: its name, and the metric that it belongs to.
struct MetricNumber {
  // Name in summary.json: "extended.mechanical_work_J.left".
  std::string name;
  // Null if the metric is not in the catalog; label and unit are then derived from the name.
  const MetricInfo* metric = nullptr;
  MetricPart part = MetricPart::kItself;
  // Part of the name after the metric's own name: arm, stage, ...
  std::string of;

  std::string label() const;  // "servo work, left"; for a task's own metric, the task's name for it
  std::string_view shown_unit() const { return metric ? metric->shown_unit : std::string_view(); }
  double scale() const { return metric ? metric->scale : 1; }
};

MetricNumber FindMetric(const std::string& name);

// Returns the names of a metric's values, without the parts that name an arm, gripper, stage or object.
std::vector<std::string> NamesOf(const MetricInfo& metric);

// Returns the main metrics among these numbers, in the order of MetricInfo::main. For a metric with values
// per arm and for both arms together, returns the value for both; for jerk, the root mean square.
std::vector<MetricNumber> MainMetrics(const std::vector<std::string>& names);

// Formats a value in SI units as a number in the shown unit; "-" if it is not finite. error: standard error
// of the value, which limits the digits shown; 0 or NaN if the value is exact.
std::string ShownValue(const MetricInfo& metric, double value, double error = 0);
// Appends the shown unit to ShownValue().
std::string ShownWithUnit(const MetricInfo& metric, double value);

}  // namespace evalbus
