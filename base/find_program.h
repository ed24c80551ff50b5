// Programs of others.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// The program of this name: the system's own, else the first in PATH; empty where there is none. (Of ffmpeg,
// say, a conda environment may have another, with other encoders.) EVALBUS_PATH, folders with colons, goes
// before both.
std::filesystem::path FindProgram(const std::string& name);

}  // namespace evalbus
