// Compares run.json with the MODEL in the run's logs.
#pragma once

#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "results/run_reader.h"

namespace evalbus::results {

// Returns the values of run.json that differ from this MODEL, for example "control_hz is 20, MODEL has 50".
// Keys that run.json lacks because an older version wrote it are not compared.
std::vector<std::string> ModelDifferences(const RecordedRun& run, const model_info_t& model);

}  // namespace evalbus::results
