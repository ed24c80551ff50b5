// Metric values as JSON with the names, nesting and value types of RoboEval's result dictionary. The only
// place that knows these names.
#pragma once

#include <nlohmann/json.hpp>

#include "evalbus/extended_metrics_t.hpp"
#include "evalbus/metric_values_t.hpp"

namespace evalbus {

// Keys of what is not tracked or has no sample are absent. Values by arm are {"left": , "right": } for two
// arms, plain numbers for one.
nlohmann::ordered_json ResultJson(const metric_values_t& values);

// Our own metrics; for the key "extended" beside the dictionary above. `values` gives the names of stages and
// arms.
nlohmann::ordered_json ExtendedJson(const extended_metrics_t& extended, const metric_values_t& values);

}  // namespace evalbus
