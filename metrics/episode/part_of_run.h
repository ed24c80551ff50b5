// Information that a metrics process reads from the folder of its run at startup.
#pragma once

#include <filesystem>

namespace evalbus::metrics {

// Whether the run has episodes whose messages a metrics process started now will not receive: episodes that
// have already finished, or those of other workers. Throws InputError if run.json is invalid.
bool IsPartOfRun(const std::filesystem::path& run_folder);

}  // namespace evalbus::metrics
