// Success, completion time and jerk of a policy as functions of its inference delay.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "metrics/statistics/interval.h"
#include "results/comparison.h"
#include "results/run_reader.h"

namespace evalbus::results {

// A mean or a rate with its 95 % interval. Members are NaN if there is no value or no interval.
struct MeasuredMean {
  double mean;
  metrics::Interval interval;
};

// Results over all episodes with one delay and one execution mode.
struct DelayPoint {
  std::string execution;  // as in --execution
  double delay_ms = 0;
  // The delay in control ticks, rounded up, and the duration of these ticks.
  int64_t delay_ticks = 0;
  double applied_ms = 0;
  int complete = 0;
  // Success rate over all complete episodes, completion time in s over the successful ones, and RMS joint
  // jerk in rad/s^3 over all complete episodes.
  MeasuredMean success, completion_time_s, joint_jerk_radps3;
  // Means over all complete episodes; NaN in runs of older versions.
  double stale_action_ratio = 0, effective_hz = 0, action_age_s = 0;
};

// Throws InputError if the run has no fixed delay.
DelayPoint ReadDelayPoint(const RecordedRun& run);

// Compares the success rate at a delay with the success rate at the smallest delay of the same execution
// mode.
struct DelayEffect {
  // Indices of the two points.
  size_t point = 0, reference = 0;
  SuccessComparison success;
};

// Returns the effects of all delays but the smallest one of each execution mode, with p adjusted with Holm's
// method for all effects. runs: the run of each point. Throws the errors of CompareVerdicts().
std::vector<DelayEffect> CompareDelays(const std::vector<DelayPoint>& points,
                                       const std::vector<RecordedRun>& runs);

// States whether success depends on the delay: a line for each execution mode, one on the test and, if there
// are too few pairs to show any effect, one on the number that is needed.
std::vector<std::string> DelayHeadline(const std::vector<DelayPoint>& points,
                                       const std::vector<DelayEffect>& effects);

// Return the points as a table for the terminal, as JSON, and as CSV with one line per point and empty fields
// for missing numbers.
std::string DelayTable(const std::vector<DelayPoint>& points);
nlohmann::ordered_json DelayJson(const std::vector<DelayPoint>& points);
std::string DelayCsv(const std::vector<DelayPoint>& points);

}  // namespace evalbus::results
