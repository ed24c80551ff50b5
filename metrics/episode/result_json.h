// Metric values as JSON with the names, nesting and value types of RoboEval's result dictionary, as
// lcmtypes/metric_catalog.h has them.
#pragma once

#include <nlohmann/json.hpp>

#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/explanation_t.hpp"
#include "evalbus/extended_metrics_t.hpp"
#include "evalbus/metric_values_t.hpp"
#include "metrics/statistics/run_statistics.h"

namespace evalbus::metrics {

// Keys of what is not tracked or has no sample are absent. Values by arm are {"left": , "right": } for two
// arms, plain numbers for one.
nlohmann::ordered_json ResultJson(const metric_values_t& values);

// Our own metrics; for the key "extended" beside the dictionary above. null where there is no value. `values`
// gives the names of stages.
nlohmann::ordered_json ExtendedJson(const extended_metrics_t& extended, const metric_values_t& values);

// For the key "explanation" (docs/run_folder.md).
nlohmann::ordered_json ExplanationJson(const explanation_t& explanation);

// For the key "parameters" of an episode that evalbus simulates: what was drawn for its start.
nlohmann::ordered_json ParametersJson(const episode_begin_t& begin);

// The numbers that statistics are made of: the same as of the line of episodes.jsonl.
EpisodeResult ResultOf(const episode_begin_t& begin, const episode_summary_t& summary);

}  // namespace evalbus::metrics
