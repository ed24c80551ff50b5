// Checks whether a disk can be written to.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Reason why nothing can be written into the folder ("no space left on the disk of runs/a"), for processes
// that can no longer write it to their own log. Empty if the folder is writable.
std::string WhyNotWritable(const std::filesystem::path& folder);

}  // namespace evalbus
