// Checks the log of a finished episode. Commands that delete another copy of the log call it first.
#pragma once

#include "evalbus/model_info_t.hpp"
#include "results/run_reader.h"

namespace evalbus::results {

// Throws InputError, with one line that names the log, unless the log of this episode exists and is complete
// (no byte and no event is missing). The log must also contain this run's models, and the score and the start
// parameters of the episode's line in episodes.jsonl. `evalbus rescore` can then use it. Reads the whole log
// but computes no scores, so that logs of older versions and of tasks with plugins can be checked anywhere.
// Returns the log's MODEL.
model_info_t CheckLog(const RecordedRun& run, const RecordedEpisode& episode);

}  // namespace evalbus::results
