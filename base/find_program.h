// Locates external programs.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Path of the program: the system's own, else the first one in PATH, else the one beside this program; empty
// if there is none. The system's is preferred because a conda environment may contain, for example, an ffmpeg
// with other encoders. If EVALBUS_PATH is set, its folders (separated by colons) replace the system's and
// PATH.
std::filesystem::path FindProgram(const std::string& name);

// Path of ffmpeg: as for FindProgram, else the program that EVALBUS_FFMPEG names. The Python package sets the
// variable to the ffmpeg of PyPI's imageio-ffmpeg. Empty if there is none.
std::filesystem::path FindFfmpeg();
inline constexpr char kInstallFfmpeg[] = "'apt-get install ffmpeg' or 'pip install imageio-ffmpeg'";

}  // namespace evalbus
