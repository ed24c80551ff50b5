// Scores as people read them: one row for each metric, with the catalog's words, and sentences made of
// them.
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
  // In SI units. By arm or gripper, whose names `of` has; both are empty for a metric that is one number.
  std::vector<std::string> of;
  std::vector<double> each;
  // The one number, or that of all arms together; NaN where there is none.
  double whole = std::numeric_limits<double>::quiet_NaN();

  // The whole; of a single arm its own.
  double value() const { return each.size() == 1 ? each[0] : whole; }
};

// What the run tracks, in the order of the catalog; success and stages are no numbers and have no row.
std::vector<ScoreRow> ScoreRows(const metric_values_t& values, const extended_metrics_t& extended);

// Those of it that one looks at first.
std::vector<ScoreRow> FirstRows(const metric_values_t& values, const extended_metrics_t& extended);

struct StageRow {
  std::string name;
  bool reached = false;
  // Simulated time at which it was first reached, s; -1: not yet.
  double time = -1;
};
std::vector<StageRow> StageRows(const metric_values_t& values, const extended_metrics_t& extended);
// What stands before a stage's name.
inline const char* StageMark(bool reached) { return reached ? "●" : "○"; }

// "1/4": how many stages are reached.
std::string StageCount(const metric_values_t& values);

// "stages 1/2  slips 0  wrist path 1.250 m ...": the first rows in one line.
std::string ScoreLine(const metric_values_t& values, const extended_metrics_t& extended);

// "50 % (anytime CI 9 to 91)": a success rate with its confidence sequence at 95 %, all in shares.
std::string AnytimeRateText(double rate, double lower, double upper);

// "2 of 10 done, success 50 % (anytime CI 9 to 91)"; of all of them with the interval for a run that is over,
// of a part of the run "2 of 10 counted here". planned: 0 = not known.
std::string DoneText(const run_summary_t& run, int planned);

// "1.00": simulated seconds per second.
std::string SpeedText(double speed);

}  // namespace evalbus::viz
