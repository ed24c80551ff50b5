// Information that a metrics process reads from the folder of its run at startup.
#pragma once

#include <filesystem>

namespace evalbus::metrics {

// Returns whether a metrics process that is started now will miss the messages of some episodes of the run,
// because they have already finished or belong to other workers. Throws InputError if run.json is invalid.
bool IsPartOfRun(const std::filesystem::path& run_folder);

}  // namespace evalbus::metrics
