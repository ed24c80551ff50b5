// What a metrics process learns from the folder of its run before it begins.
#pragma once

#include <filesystem>

namespace evalbus::metrics {

// Whether the run has episodes that a metrics process starting now will not hear of: finished ones, or those
// of other workers. Throws InputError where run.json is none.
bool IsPartOfRun(const std::filesystem::path& run_folder);

}  // namespace evalbus::metrics
