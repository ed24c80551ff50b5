// Programs of others.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// The program of this name in PATH; empty where there is none.
std::filesystem::path FindProgram(const std::string& name);

}  // namespace evalbus
