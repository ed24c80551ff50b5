// Locates external programs.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Path of the program: the system's own, else the first one in PATH; empty if there is none. The system's is
// preferred because a conda environment may contain, for example, an ffmpeg with other encoders. Folders in
// EVALBUS_PATH (separated by colons) take precedence over both.
std::filesystem::path FindProgram(const std::string& name);

}  // namespace evalbus
