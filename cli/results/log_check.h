// Checks the log of a finished episode, for commands that remove another copy of it.
#pragma once

#include "cli/results/run_reader.h"
#include "evalbus/model_info_t.hpp"

namespace evalbus::results {

// Throws InputError, one line that names the log, unless the log of this episode is there, whole (no byte and
// no event is missing), of this run's models, and holds the score that the episode's line in episodes.jsonl
// states: then `evalbus rescore` finds in it all that it needs. Reads the whole log but scores nothing, so
// that logs of an older evalbus and of tasks with plugins can be checked anywhere. Returns the log's MODEL.
model_info_t CheckLog(const RecordedRun& run, const RecordedEpisode& episode);

}  // namespace evalbus::results
