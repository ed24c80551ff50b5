// Scores for display: one row per metric with label and unit from the catalog, and texts made from these
// rows.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "evalbus/extended_metrics_t.hpp"
#include "evalbus/metric_values_t.hpp"
#include "evalbus/run_summary_t.hpp"
#include "lcmtypes/metric_catalog.h"

namespace evalbus::viz {

struct ScoreRow {
  const MetricInfo* metric = nullptr;
  MetricPart part = MetricPart::kItself;
  std::string label;  // "wrist jerk, rms", "left_gripper_to_pot"
  // Values in SI units (`each`) of the arms or grippers named in `of`. Both are empty for a scalar metric.
  std::vector<std::string> of;
  std::vector<double> each;
  // The scalar value, or the value of all arms together; NaN if unavailable.
  double whole = std::numeric_limits<double>::quiet_NaN();

  // The overall value. With a single arm, it is the value of that arm.
  double value() const { return each.size() == 1 ? each[0] : whole; }
};

// Returns the tracked metrics in the order of the catalog. Success and the individual stages are not numbers
// and have no row.
std::vector<ScoreRow> ScoreRows(const metric_values_t& values, const extended_metrics_t& extended);

// Returns the most important of these rows.
std::vector<ScoreRow> FirstRows(const metric_values_t& values, const extended_metrics_t& extended);

struct StageRow {
  std::string name;
  bool reached = false;
  // Simulated time at which the stage was first reached, s; -1 if it was not reached.
  double time = -1;
};
std::vector<StageRow> StageRows(const metric_values_t& values, const extended_metrics_t& extended);
// Returns the symbol that is shown before a stage's name.
inline const char* StageMark(bool reached) { return reached ? "●" : "○"; }

// Returns the number of reached stages and of all stages, such as "1/4".
std::string StageCount(const metric_values_t& values);

// Returns the most important rows in one line, such as "stages 1/2  slips 0  wrist path 1.250 m ...".
std::string ScoreLine(const metric_values_t& values, const extended_metrics_t& extended);

// Returns a success rate with its 95 % confidence sequence, such as "50 % (anytime CI 9 to 91)". Arguments
// are shares from 0 to 1.
std::string AnytimeRateText(double rate, double lower, double upper);

// Returns text such as "2 of 10 done, success 50 % (anytime CI 9 to 91)". After the last episode, it contains
// the Wilson interval instead. For a plan shard, the text is such as "2 of 10 counted here". planned: 0 if
// unknown.
std::string DoneText(const run_summary_t& run, int planned);

// Returns the number of simulated seconds per second, such as "1.00".
std::string SpeedText(double speed);

}  // namespace evalbus::viz
