// Files that are there are whole: written under a temporary name of this process's own, synced, renamed.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Ending of the temporary name, "FILE.PID.tmp": what a killed process leaves behind ends so.
inline constexpr char kTemporaryEnding[] = ".tmp";

// Writes a file. One that exists is replaced and keeps its permissions; a link is followed; a pipe or a
// device is written to as it is. On failure nothing is left behind and what was there stays. Throws
// InputError where the name is wrong (no such folder, no permission, a folder), else EnvironmentError.
void WriteWhole(const std::filesystem::path& file, const std::string& text);

}  // namespace evalbus
