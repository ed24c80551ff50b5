// Metric values as JSON with the names, nesting and value types of RoboEval's result dictionary, as listed in
// lcmtypes/metric_catalog.h.
#pragma once

#include <nlohmann/json.hpp>

#include "evalbus/cause_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/explanation_t.hpp"
#include "evalbus/extended_metrics_t.hpp"
#include "evalbus/metric_values_t.hpp"
#include "metrics/statistics/run_statistics.h"

namespace evalbus::metrics {

// Unavailable values, and metrics that are not tracked (except the slip counts), have no key; nor have
// metrics of two arms before the first sample. Values by arm are {"left": , "right": } for two arms, and
// plain numbers for one.
nlohmann::ordered_json ResultJson(const metric_values_t& values);

// Returns the value of the key "extended": the metrics defined by evalbus. A value that does not exist is
// null. `values` provides the indices of the stages.
nlohmann::ordered_json ExtendedJson(const extended_metrics_t& extended, const metric_values_t& values);

// Returns the value of the key "explanation" (docs/run_folder.md).
nlohmann::ordered_json ExplanationJson(const explanation_t& explanation);

// Returns the value of the key "cause" (docs/run_folder.md).
nlohmann::ordered_json CauseJson(const cause_t& cause);

// Returns the value of the key "parameters" of an episode that evalbus simulates: its randomized start
// parameters.
nlohmann::ordered_json ParametersJson(const episode_begin_t& begin);

// Returns the final poses of an episode, which PosesJson() converts to the value of the key "final_poses".
NamedPoses PosesOf(const episode_summary_t& summary);

// Returns the numbers for the statistics. They equal the numbers that are read from the episode's line in
// episodes.jsonl.
EpisodeResult ResultOf(const episode_begin_t& begin, const episode_summary_t& summary);

}  // namespace evalbus::metrics
