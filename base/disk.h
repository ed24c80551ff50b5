// Checks whether a disk can be written to.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Returns the reason why nothing can be written into the folder ("no space left on the disk of runs/a");
// empty if the folder is writable. It is meant for reporting on processes that cannot write the reason to
// their own log.
std::string WhyNotWritable(const std::filesystem::path& folder);

}  // namespace evalbus
