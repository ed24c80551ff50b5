// Checks whether a disk can be written to.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Returns the reason why the disk of the folder cannot be written to: it is read-only, or it has almost no
// space or no inodes left ("no space left on the disk of runs/a"). Empty if the disk can be written to or the
// folder does not exist; permissions are not checked. The text is meant for reporting on processes that
// cannot write the reason to their own log.
std::string WhyNotWritable(const std::filesystem::path& folder);

}  // namespace evalbus
