// Checks the log of a finished episode, and compares its MODEL with run.json. Commands that delete another
// copy of the log call CheckLog() first.
#pragma once

#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "results/run_reader.h"

namespace evalbus::results {

// Throws InputError, with one line that names the log, unless the log of this episode exists and is complete
// (no byte and no event is missing). The log must also contain this run's models, and the score and the start
// parameters of the episode's line in episodes.jsonl. `evalbus rescore` can then use it. Reads the whole log
// but computes no scores, so that logs of older versions and of tasks with plugins can be checked anywhere.
// Returns the log's MODEL.
model_info_t CheckLog(const RecordedRun& run, const RecordedEpisode& episode);

// Returns the values of run.json that differ from this MODEL, for example "control_hz is 20, MODEL has 50".
// Keys that run.json lacks because an older version wrote it are not compared.
std::vector<std::string> ModelDifferences(const RecordedRun& run, const model_info_t& model);

}  // namespace evalbus::results
