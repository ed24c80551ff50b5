// Locates external programs.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Returns the path of the program; empty if it is not found. It is searched first in /usr/bin, then in PATH,
// then next to this program. /usr/bin comes first because a conda environment may contain, for example, an
// ffmpeg with other encoders. If EVALBUS_PATH is set, its folders (separated by colons) replace /usr/bin and
// PATH.
std::filesystem::path FindProgram(const std::string& name);

// Returns the path of ffmpeg as found by FindProgram() or, if it is not found, the value of EVALBUS_FFMPEG if
// that is an executable file; otherwise empty. The Python package sets this variable to the ffmpeg of PyPI's
// imageio-ffmpeg.
std::filesystem::path FindFfmpeg();
inline constexpr char kInstallFfmpeg[] = "'apt-get install ffmpeg' or 'pip install imageio-ffmpeg'";

}  // namespace evalbus
