// The metrics of a gate (gate.h): which ones are meant, and the decision on each.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/metric_catalog.h"
#include "results/gate.h"
#include "results/run_reader.h"

namespace evalbus::results {

// Complete episodes with equal seeds: of the run, and of the baseline.
using EpisodePairs = std::vector<std::pair<const RecordedEpisode*, const RecordedEpisode*>>;

struct GateMetric {
  MetricNumber number;
  GateMargin margin;
};

// Finds the metrics of GateOptions::on among the numbers of these episodes. "success" is accepted and left
// out. A metric without a margin of its own has `margin`, in percent. Throws InputError.
std::vector<GateMetric> ParseGateMetrics(const std::vector<std::string>& on, const GateMargin& margin,
                                         const EpisodePairs& pairs);

// The decision on a metric, without GateCriterion::why. Effort metrics cover the pairs in which both
// succeeded, others the pairs of which both have a value. fail_alpha: error probability of FAIL.
GateCriterion DecideMetric(const GateMetric& metric, const EpisodePairs& pairs, double fail_alpha);

}  // namespace evalbus::results
