// Decides whether a run may replace its baseline, with non-inferiority tests on episodes with equal seeds.
// PASS and FAIL each have an error probability of at most 5 % (more for few pairs of strongly skewed
// metrics); otherwise the verdict is CANNOT TELL. Has no side effects; report/gate_files.h writes files.
// docs/gate.md describes the rules and their measured errors.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "results/run_reader.h"

namespace evalbus::results {

enum class GateVerdict { kPass, kFail, kCannotTell };
// Returns "PASS", "FAIL" or "CANNOT TELL".
const char* Word(GateVerdict verdict);

// Largest acceptable loss. The margin of success is in percentage points. The margin of a metric is in its
// display unit or, if is_percent, in percent of the baseline's mean.
struct GateMargin {
  double value = 5;
  bool is_percent = true;
};

struct GateOptions {
  GateMargin margin;
  // Metrics that are tested in addition to success: NAME, NAME:MARGIN or NAME:PERCENT%. NAME is a name from
  // summary.json or a label of a main metric ("slips", "wrist path" or wrist_path).
  std::vector<std::string> on;
  // False if no log of the run shows a commanded motion (commanded_motion.h). Such a run does not pass.
  bool has_commanded_motion = true;
};

// The decision on one value. A loss is a change for the worse, in `unit`; a gain is a negative loss.
struct GateCriterion {
  // Name of the value: "success" or the metric's label.
  std::string what;
  GateVerdict verdict = GateVerdict::kCannotTell;
  int pairs = 0;
  // True for effort metrics, which cover only the pairs in which both episodes succeeded.
  bool pairs_are_successes = false;
  // Means over the pairs, in `mean_unit` ("%" for success).
  double baseline_mean = 0, mean = 0;
  std::string mean_unit;
  double loss = 0;
  // One-sided bounds of the loss: PASS if upper < margin, FAIL if lower > margin. NaN if there are none. Both
  // are equal to the loss if all pairs have the same loss; such a loss also passes if it equals the margin.
  double loss_lower = 0, loss_upper = 0;
  double margin = 0;
  // Unit of losses and margin: "points", "slips", "%", ...
  std::string unit;
  // Error probability of FAIL: 5 % divided by the number of criteria. The error probability of PASS is 5 %.
  double fail_alpha = 0.05;
  // Number of further pairs that would lead to a decision with 80 % probability if the observed values are
  // the true ones.
  std::optional<int> more_pairs;
  // A sentence with the numbers on which the verdict is based.
  std::string why;
};

struct GateTask {
  // Name of the task, TASK/VARIATION.
  std::string name;
  int pairs = 0, successes = 0, baseline_successes = 0;
  // gained: number of pairs in which only the run succeeded. lost: number of pairs in which only the baseline
  // succeeded.
  int gained = 0, lost = 0;
};

struct Gate {
  std::string run, baseline;
  GateVerdict verdict = GateVerdict::kCannotTell;
  // Reason for the verdict, in one line.
  std::string why;
  // Decisions on each value; the first one is success.
  std::vector<GateCriterion> criteria;
  std::vector<GateTask> tasks;
  // Notes on the compared episodes, one line each.
  std::vector<std::string> remarks;
};

// Throws InputError if the runs cannot be compared (as CompareVerdicts() does), have no equal seeds, or if
// the run lacks a task of the baseline or the baseline has a task without a finished episode. Also throws it
// if a run was not simulated, has no complete episode, contains only collected demonstrations, or stopped
// depending on its results. The same holds if a metric of `on` is unknown or has no better direction.
Gate Decide(const RecordedRuns& run, const RecordedRuns& baseline, const GateOptions& options);

// Formats a bound of a loss and its unit, for example "4.2 points". It has at least one decimal, and enough
// to be compared with the margin. Upper bounds are rounded up and lower bounds down. A bound of at least 1e-6
// is never shown as 0.
enum class BoundFrom { kAbove, kBelow };
std::string LossText(const GateCriterion& criterion, double loss, BoundFrom from);
// Returns a mean of the criterion with its unit, for example "81.7 %".
std::string MeanText(const GateCriterion& criterion, double mean);

// Returns GateCriterion::why, for example "success 90.0 -> 88.0 % in 200 pairs: a loss of at most 4.2 points
// (one-sided 95 % bound), margin 5 points".
std::string WhyText(const GateCriterion& criterion);

// Returns the output of `evalbus gate`: one line with the verdict and its reason, one line per criterion if
// there are several, and the remarks.
std::string GateText(const Gate& gate);

}  // namespace evalbus::results
