// Finds the metrics of a gate (gate.h) by name, and computes the verdict of each metric.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/metric_catalog.h"
#include "results/gate.h"
#include "results/run_reader.h"

namespace evalbus::results {

// Pairs of complete episodes with equal seeds: the run's episode first, then the baseline's.
using EpisodePairs = std::vector<std::pair<const RecordedEpisode*, const RecordedEpisode*>>;

struct GateMetric {
  MetricNumber number;
  GateMargin margin;
};

// Finds the metrics of GateOptions::on among the numbers that both sides of these pairs have. "success" is
// accepted and omitted. A metric without its own margin gets `margin`, in percent. Throws InputError.
std::vector<GateMetric> ParseGateMetrics(const std::vector<std::string>& on, const GateMargin& margin,
                                         const EpisodePairs& pairs);

// Decides on a metric, without setting GateCriterion::why. Effort metrics cover the pairs in which both
// episodes succeeded; other metrics cover the pairs in which both episodes have a value. fail_alpha: error
// probability of FAIL.
GateCriterion DecideMetric(const GateMetric& metric, const EpisodePairs& pairs, double fail_alpha);

}  // namespace evalbus::results
